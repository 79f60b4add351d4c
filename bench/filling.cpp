// `kinespace bench filling`: gaps cut into clips that the library does not have, filled, against the truth and against
// straight lines and slerp.
#include "kinespace/synthesis/filling.h"

#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <vector>

#include <fmt/format.h>

#include "bench/filling_measures.h"
#include "bench/report.h"
#include "kinespace/base/parallel.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr int held_out_every = 7;
constexpr double step_s = 1.5;    // between the gaps of a clip
constexpr double margin_s = 0.5;  // seen at least on either side
constexpr std::array<double, 3> levels = {0.5, 0.8, 0.95};

struct Split {
  std::string name;
  std::vector<Clip> library;
  std::vector<Clip> held_out;
};

Split load_split(const std::filesystem::path& folder) {
  Split out{.name = folder.filename().string(), .library = {}, .held_out = {}};
  const auto files = find_motion_files({folder});
  std::vector<Clip> clips(files.size());
  parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { clips[i] = read_clip(files[i]); });
  for (std::size_t i = 0; i < clips.size(); ++i) {
    (i % held_out_every == held_out_every - 1 ? out.held_out : out.library).push_back(std::move(clips[i]));
  }
  return out;
}

struct Cut {
  std::size_t clip = 0;
  FrameRange gap;
};

std::vector<Cut> cuts_of(const std::vector<Clip>& clips, double gap_s) {
  std::vector<Cut> out;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const double rate = clips[i].rate_hz;
    const int gap = static_cast<int>(std::lround(gap_s * rate));
    const int free = clips[i].frames - gap - 2 * static_cast<int>(std::lround(margin_s * rate));
    if (free < 0) continue;
    const int step = static_cast<int>(std::lround(step_s * rate));
    const int count = free / step + 1;
    const int start = (clips[i].frames - gap - (count - 1) * step) / 2;
    for (int k = 0; k < count; ++k) out.push_back({i, {start + k * step, start + k * step + gap - 1}});
  }
  return out;
}

// How often each joint's error on each axis lies within the interval of each level.
struct Coverage {
  std::array<double, levels.size()> inside = {};
  double all = 0;

  void add(const FillModel& model, const Clip& truth, const FillResult& filled) {
    const FrameRange gap = filled.gaps.front().frames;
    const JointPositions is = joint_positions(slice(filled.clip, gap.first_frame, gap.count()));
    const JointPositions should = joint_positions(slice(truth, gap.first_frame, gap.count()));
    std::array<double, levels.size()> factor{};
    for (std::size_t l = 0; l < levels.size(); ++l) factor[l] = model.interval(levels[l]);
    for (int f = 0; f < gap.count(); ++f) {
      for (int j = truth.skeleton.travel_root(); j < is.joints; ++j) {
        const double std_cm = filled.gaps.front().std_cm(f, j);
        for (int axis = 0; axis < 3; ++axis) {
          const double error = std::abs(is.at(f, j)(axis) - should.at(f, j)(axis));
          for (std::size_t l = 0; l < levels.size(); ++l) inside[l] += error <= factor[l] * std_cm ? 1 : 0;
          ++all;
        }
      }
    }
  }
};

void gap_rows(const FillModel& model, const Split& data, const PositionScale& scale, double gap_s, double bar,
              BenchReport& report) {
  const std::vector<Cut> cuts = cuts_of(data.held_out, gap_s);
  FillingMeasures ours(scale);
  FillingMeasures slerp(scale);
  Coverage coverage;
  double seconds = 0;
  for (const Cut& cut : cuts) {
    const Clip& truth = data.held_out[cut.clip];
    const Clip straight = interpolate_gap(truth, cut.gap);  // what fill gets knows nothing of the truth
    const auto start = std::chrono::steady_clock::now();
    const FillResult filled = fill(model, straight, cut.gap);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ours.add(truth, filled.clip, cut.gap);
    slerp.add(truth, straight, cut.gap);
    coverage.add(model, truth, filled);
  }
  const std::string on = fmt::format("{}, {} gaps of {} s", data.name, cuts.size(), gap_s);
  const auto row = [&](std::string name, double value, std::string unit, std::optional<double> limit = {}) {
    report.results.push_back(
        {.name = std::move(name), .data = on, .value = value, .unit = std::move(unit), .bar = limit});
  };
  row("mean joint error over slerp's", ours.joint_error_cm() / slerp.joint_error_cm(), "", bar);
  row("mean joint error", ours.joint_error_cm(), "cm");
  row("mean joint error, slerp", slerp.joint_error_cm(), "cm");
  row("L2P", ours.l2p(), "");
  row("L2P, slerp", slerp.l2p(), "");
  row("L2Q", ours.l2q(), "");
  row("L2Q, slerp", slerp.l2q(), "");
  row("NPSS", ours.npss(), "");
  row("NPSS, slerp", slerp.npss(), "");
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const double covered = 100 * coverage.inside[l] / coverage.all;
    row(fmt::format("truth inside the {:.0f} % interval", 100 * levels[l]), covered, "%");
    row(fmt::format("the {:.0f} % interval is off by", 100 * levels[l]), std::abs(covered - 100 * levels[l]), "points",
        5);
  }
  row("time of a fill", 1000 * seconds / static_cast<double>(cuts.size()), "ms");
}

void data_rows(const std::filesystem::path& folder, BenchReport& report) {
  const Split data = load_split(folder);
  const PositionScale scale = position_scale(data.library);
  const auto start = std::chrono::steady_clock::now();
  const PreparedSource source{static_cast<int>(data.library.size()), [&](int i) {
                                const Clip& clip = data.library[static_cast<std::size_t>(i)];
                                return PreparedClip{.skeleton = clip.skeleton, .curves = clip_curves(clip), .runs = {}};
                              }};
  const FillModel model = FillModel::build(source);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.results.push_back({.name = "time to build the model",
                            .data = fmt::format("{}, {} clips", data.name, model.clips()),
                            .value = seconds,
                            .unit = "s",
                            .bar = std::nullopt});
  constexpr std::array<std::pair<double, double>, 3> bars = {{{0.5, 0.48}, {1.0, 0.44}, {1.5, 0.57}}};
  for (const auto& [gap_s, bar] : bars) gap_rows(model, data, scale, gap_s, bar, report);
}

}  // namespace

BenchReport bench_filling(const BenchOptions& options) {
  BenchReport report{.bench = "filling", .device = "cpu", .threads = 2, .results = {}};
  data_rows(options.data / "bandai2", report);
  data_rows(options.data / "cmu", report);
  return report;
}

}  // namespace kinespace
