// `kinespace bench codecs`: what codecs make of clips. Sizes of the motion-space codec at given errors and its speed;
// every codec over its range of qualities; the tables and figures of khan2014.
#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "bench/codec_papers.h"
#include "bench/report.h"
#include "bench/timing.h"
#include "kinespace/codecs/qbc/quadratic_bezier.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

// All frames of a set, as the streams they are coded in.
struct CodecData {
  std::string name;
  std::vector<std::vector<Clip>> streams;

  [[nodiscard]] double frames() const {
    double out = 0;
    for (const auto& clips : streams) {
      for (const Clip& clip : clips) out += clip.frames;
    }
    return out;
  }
};

std::vector<Clip> read_folder(const fs::path& folder) {
  std::vector<Clip> out;
  for (const fs::path& file : find_motion_files({folder})) out.push_back(read_clip(file));
  return out;
}

struct CodecBar {
  double error_cm;
  double bytes_per_frame;
};

// Decoding on one core, the fastest of a few rounds: other processes only slow it down.
double decoding_seconds(const std::vector<Bytes>& streams) {
  constexpr int rounds = 4;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    best = std::min(best, seconds([&] {
                      for (const Bytes& stream : streams) {
                        static_cast<void>(open_stream(stream, "bench")->decode_all());
                      }
                    }));
  }
  return best;
}

void measure(const CodecData& data, const CodecBar& bar, BenchReport& report) {
  const double frames = data.frames();
  std::vector<Bytes> streams;
  double bytes = 0, mean = 0, shell = 0, largest = 0;
  const double encoding = seconds([&] {
    for (const auto& clips : data.streams) {
      streams.push_back(encode("motion-space", clips, {.target = {.mean_error_cm = bar.error_cm}}));
    }
  });
  for (std::size_t s = 0; s < streams.size(); ++s) {
    const MeasuredError error = Bitstream::parse(streams[s], "bench").error();
    double part = 0;
    for (const Clip& clip : data.streams[s]) part += clip.frames / frames;
    bytes += static_cast<double>(streams[s].size());
    mean += part * error.mean_joint_error_cm;
    shell += part * error.shell_error_cm;
    largest = std::max(largest, error.max_joint_error_cm);
  }
  const auto add = [&](const char* what, double value, const char* unit, std::optional<double> limit, bool higher) {
    report.results.push_back({.name = fmt::format("motion-space at {} cm: {}", bar.error_cm, what),
                              .data = data.name,
                              .value = value,
                              .unit = unit,
                              .bar = limit,
                              .higher_is_better = higher});
  };
  add("size", bytes / frames, "bytes/frame", bar.bytes_per_frame, false);
  add("mean joint error", mean, "cm", bar.error_cm, false);
  add("shell error over mean joint error", shell / mean, "x", 1.6, false);
  add("largest joint error", largest, "cm", {}, false);
  add("encoding, target search included", frames / encoding, "frames/s", 20000, true);
  add("decoding to local rotations, one core", frames / decoding_seconds(streams), "frames/s", 300000, true);
}

// Largest errors, on every clip by itself.
void measure_largest(const CodecData& data, double target_cm, std::size_t every, BenchReport& report) {
  double clips = 0, kept = 0;
  for (const auto& stream : data.streams) {
    for (std::size_t c = 0; c < stream.size(); c += every) {
      const Bytes bytes =
          encode("motion-space", std::span(stream).subspan(c, 1), {.target = {.max_error_cm = target_cm}});
      ++clips;
      kept += Bitstream::parse(bytes, "bench").error().max_joint_error_cm <= target_cm ? 1 : 0;
    }
  }
  report.results.push_back(
      {.name = fmt::format("motion-space: {:.0f} clips that keep to a largest error of {} cm", clips, target_cm),
       .data = data.name,
       .value = 100 * kept / clips,
       .unit = "%",
       .bar = 100,
       .higher_is_better = true});
}

double bytes_at(std::string_view codec, const CodecData& data, double error_cm) {
  double out = 0;
  for (const auto& clips : data.streams) {
    out += static_cast<double>(encode(codec, clips, {.target = {.mean_error_cm = error_cm}}).size());
  }
  return out;
}

// Functions fitted to the motion against fixed ones over whole clips, quantised and coded alike.
void measure_analytic(const CodecData& data, double error_cm, BenchReport& report) {
  const double ours = bytes_at("motion-space", data, error_cm);
  for (const auto& [codec, bar] : {std::pair("fourier", 1.0 / 3), std::pair("legendre", 1.0 / 2)}) {
    report.results.push_back({.name = fmt::format("motion-space: bytes over those of {} at {} cm", codec, error_cm),
                              .data = data.name,
                              .value = ours / bytes_at(codec, data, error_cm),
                              .unit = "x",
                              .bar = bar});
  }
}

// khan2014's break-and-fit of all joints of a clip, by the paper's rule, on one thread.
void measure_fit(const fs::path& file, BenchReport& report) {
  const Clip clip = read_clip(file);
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  const ChannelCurves curves = channel_curves(clip, layout);
  const auto frames = static_cast<std::size_t>(curves.frames);
  const auto fit = [&](int first_channel, int channels) {
    const std::size_t first = static_cast<std::size_t>(first_channel) * frames;
    return fit_quadratic_bezier(std::span(curves.values).subspan(first, static_cast<std::size_t>(channels) * frames),
                                channels, {});
  };
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 5; ++round) {
    best = std::min(best, seconds([&] {
                      static_cast<void>(fit(0, 3));
                      for (const JointFreedom& joint : layout.joints) {
                        if (joint.turns > 0) static_cast<void>(fit(joint.first_channel, joint.turns));
                      }
                    }));
  }
  report.results.push_back({.name = "qbc: fit of one clip, d^2 limit 18, all joints",
                            .data = fmt::format("{}, {} frames", clip.name, clip.frames),
                            .value = 1000 * best,
                            .unit = "ms",
                            .bar = 50});
}

// Climbing, jumping and turning, walking, running, jumping, bending: what the papers' clips do.
std::vector<fs::path> paper_clips(const BenchOptions& options) {
  if (!options.clips.empty()) return options.clips;
  std::vector<fs::path> out;
  for (const char* clip : {"01/01_01", "02/02_01", "02/02_03", "02/02_04"}) {
    out.push_back(options.data / "cmu" / (std::string(clip) + ".amc"));
  }
  return out;
}

void add_papers(const BenchOptions& options, BenchReport& report) {
  std::vector<ClipSweep> sweeps;
  for (const fs::path& clip : paper_clips(options)) sweeps.push_back(sweep_clip(clip));
  add_khan2014(sweeps, report);
  for (const ClipSweep& sweep : sweeps) add_sweep(sweep, report);
}

void add_motion_space(const BenchOptions& options, BenchReport& report) {
  CodecData bandai{.name = "bandai2, one stream", .streams = {}};
  bandai.streams.push_back(read_folder(options.data / "bandai2"));
  for (const CodecBar& bar :
       {CodecBar{0.1, 14}, CodecBar{0.35, 6.5}, CodecBar{0.5, 4.5}, CodecBar{1.0, 2.6}, CodecBar{2.4, 1.2}}) {
    measure(bandai, bar, report);
  }
  measure_largest(bandai, 1, 20, report);
  CodecData cmu{.name = "cmu 01, 02, 03, a stream each", .streams = {}};
  for (const char* subject : {"01", "02", "03"}) cmu.streams.push_back(read_folder(options.data / "cmu" / subject));
  for (const CodecBar& bar :
       {CodecBar{0.1, 14}, CodecBar{0.35, 7}, CodecBar{0.5, 3.6}, CodecBar{0.9, 2.2}, CodecBar{2.1, 1.15}}) {
    measure(cmu, bar, report);
  }
  measure_largest(cmu, 1, 4, report);
  for (const double error_cm : {0.35, 0.9}) measure_analytic(cmu, error_cm, report);
}

}  // namespace

BenchReport bench_codecs(const BenchOptions& options) {
  BenchReport report{
      .bench = "codecs", .device = "cpu", .threads = static_cast<int>(std::thread::hardware_concurrency())};
  if (options.clips.empty()) {
    add_motion_space(options, report);
    measure_fit(options.data / "cmu/01/01_01.amc", report);
  }
  add_papers(options, report);
  return report;
}

}  // namespace kinespace
