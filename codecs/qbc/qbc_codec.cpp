// The encoder of the qbc codec, and the search for the limit that meets a target.
#include "kinespace/codecs/qbc/qbc_codec.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/detail/pole_corrections.h"
#include "kinespace/codecs/qbc/detail/qbc_stream.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/motion/curves.h"

namespace kinespace {
namespace {

constexpr std::array qbc_settings{
    CodecSetting{"max_squared_distance", 18, 1e-8, 1e6,
                 "limit d^2 of a joint's squared distance in every frame, in squared degrees (root units)"},
    CodecSetting{"interval", 160, 1, longest_segment, "frames between the breaks that all joints have"},
    CodecSetting{"root_unit", 5.6444F, 1e-3, 1e3, "cm of the root's position that count as a degree"},
    CodecSetting{"merge", 1, 0, 1, "1: breaks chosen by error and bits; 0: the paper's rule alone"},
    CodecSetting{"rate_weight", 0.05, 0, 1, "share of the limit that a bit is worth when breaks and points are chosen"},
};

struct Plan {
  double limit = 18;
  int interval = 160;
  double root_unit = 5.6444F;
  bool paper = false;
  double rate_weight = 0.05;
};

// Finer than steps of 2^-100 nothing is asked for.
int step_index_of(const Plan& plan) {
  const double step = std::sqrt(std::max(plan.rate_weight, 0.02) * plan.limit) * 1.4;
  return static_cast<int>(std::lround(-4 * std::log2(step)));
}

class QbcEncoder {
 public:
  QbcEncoder(std::span<const Clip> clips, double tolerance_degrees)
      : clips_(clips), layout_(find_channel_layout(clips, {.tolerance_degrees = tolerance_degrees})) {
    for (const Clip& clip : clips) {
      const ClipCurves curves = clip_curves(clip);
      ClipEntry entry{.name = clip.name, .rate_hz = clip.rate_hz, .frames = clip.frames};
      entry.skeleton = table_.add_skeleton(clip.skeleton, clip.name);
      entry.blocks.assign(static_cast<std::size_t>(clip.frames / longest_block), longest_block);
      if (clip.frames % longest_block > 0) entry.blocks.push_back(clip.frames % longest_block);
      entry.finer.assign(entry.blocks.size(), 0);
      entry.side_tracks = curves.side_tracks;
      table_.clips.push_back(std::move(entry));
      channels_.push_back(channel_curves(clip, layout_));
      require_encodable(channels_.back(), clip.name);
    }
    packed_clips_ = pack_clip_table(table_);
    for (std::size_t c = 0; c < clips.size(); ++c) {
      for (std::size_t j = 0; j < layout_.joints.size(); ++j) {
        if (curve_dimensions(layout_, j) > 0) curves_.emplace_back(c, j);
      }
    }
  }

  struct Result {
    Bytes stream;
    MeasuredError error;
    bool kept = true;  // the limit
  };

  [[nodiscard]] Result encode(const Plan& plan, const Progress& progress) const {
    const QbcTables tables{
        .interval = plan.interval, .step_index = step_index_of(plan), .root_unit = static_cast<float>(plan.root_unit)};
    std::vector<QbcCurve> coded(curves_.size());
    std::atomic<std::size_t> done = 0;
    std::atomic<bool> kept = true;
    tbb::parallel_for(std::size_t{0}, curves_.size(), [&](std::size_t i) {
      const auto [clip, joint] = curves_[i];
      const CurveTask wanted = task(clip, joint, plan, tables);
      CurveChoice choice = choose_curve(wanted, plan.paper);
      if (joint == 0 && !plan.paper) correct_poles(clip, wanted, choice);
      if (choice.error.largest > plan.limit) kept = false;
      coded[i] = {.finer = choice.task.step_index - tables.step_index,
                  .grid_log = bit_length(static_cast<std::uint64_t>(choice.task.grid)) - 1,
                  .code = choice.code};
      static_cast<void>(done.fetch_add(1));
    });
    static_cast<void>(progress);
    Result out{.kept = kept};
    const Bytes curves = pack_curves(tables, layout_, coded);
    const Bytes draft = write(curves, {});
    out.error = measure(draft);
    out.stream = write(curves, out.error);
    return out;
  }

 private:
  static void require_encodable(const ChannelCurves& curves, const std::string& clip) {
    for (const double v : curves.values) {
      if (std::abs(v) < 1e6) continue;
      throw Error(ErrorKind::bad_input, {.file = clip,
                                         .found = "a root farther than 10 km away, or a joint that turned 2 700 times",
                                         .expected = "positions in centimetres and rotations"});
    }
  }

  void correct_poles(std::size_t clip, const CurveTask& wanted, CurveChoice& choice) const {
    const CurveShape shape = shape_of(choice.task);
    choice.numbers.corrections = PoleCorrections(clips_[clip], layout_.joints.front())
                                     .choose(wanted, decode_curve(shape, choice.code, "the curve"));
    choice.code = encode_curve(shape, choice.numbers);
  }

  [[nodiscard]] CurveTask task(std::size_t clip, std::size_t joint, const Plan& plan, const QbcTables& tables) const {
    const JointFreedom& freedom = layout_.joints[joint];
    CurveTask out{.frames = clips_[clip].frames,
                  .dimensions = curve_dimensions(layout_, joint),
                  .limit = plan.limit,
                  .interval = plan.interval,
                  .grid = 2,
                  .step_index = tables.step_index,
                  .rate_weight = plan.rate_weight * plan.limit};
    const auto n = static_cast<std::size_t>(out.dimensions);
    out.values.resize(n * static_cast<std::size_t>(out.frames));
    for (int d = 0; d < out.dimensions; ++d) {
      const bool position = joint == 0 && d < 3;
      const int turn = joint == 0 ? d - 3 : d;
      const auto channel = channels_[clip].channel(position ? d : freedom.first_channel + turn);
      const double unit = position ? static_cast<double>(tables.root_unit) : 1;
      for (std::size_t f = 0; f < channel.size(); ++f)
        out.values[f * n + static_cast<std::size_t>(d)] = channel[f] / unit;
    }
    return out;
  }

  [[nodiscard]] Bytes write(const Bytes& curves, const MeasuredError& error) const {
    BitstreamWriter out(stream_kind("qbc"));
    out.set_error(error);
    out.add_section("clips", packed_clips_);
    out.add_section("curves", curves);
    const std::int64_t frames = table_.frames();
    const auto size = static_cast<std::int64_t>(packed_clips_.size() + curves.size());
    const std::int64_t needed = (frames - most_qbc_frames(0) + 255) / 256;
    if (needed > size) out.add_section("padding", Bytes(static_cast<std::size_t>(needed - size), std::byte{0}));
    return out.finish();
  }

  [[nodiscard]] MeasuredError measure(const Bytes& stream) const {
    const auto reader = find_codec("qbc").open(Bitstream::parse(stream, "the stream"));
    std::vector<ClipErrorSums> parts(clips_.size());
    tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
      parts[c] = clip_error(clips_[c], static_cast<const StreamReader&>(*reader).decode(c), 0, clips_[c].frames, 0);
    });
    ClipErrorSums out;
    for (const ClipErrorSums& part : parts) out.add(part);
    return out.measured();
  }

  std::span<const Clip> clips_;
  ChannelLayout layout_;
  ClipTable table_;
  Bytes packed_clips_;
  std::vector<ChannelCurves> channels_;
  std::vector<std::pair<std::size_t, std::size_t>> curves_;  // clip, joint
};

// The largest limit whose stream keeps an error, or the smallest whose stream keeps to a size.
class LimitSearch {
 public:
  LimitSearch(std::span<const Clip> clips, Plan plan, const CodecOptions& options)
      : encoder_(clips, tolerance(options.target)), plan_(plan), options_(options) {}

  Bytes find() {
    const CodecTarget& target = options_.target;
    double log_limit = std::log(target.bytes ? 18 : first_guess(target));
    double low = std::log(target.bytes ? 1e-4 : 1e-8), high = std::log(1e6);  // met somewhere at or beyond one of them
    constexpr int most_rounds = 26;
    for (int round = 0; round < most_rounds && high - low > 0.003; ++round) {
      const double ratio = attempt(std::exp(log_limit));
      if (ratio <= 1 && ratio > 0.985) break;
      const bool up = target.bytes ? ratio > 1 : ratio <= 1;
      (up ? low : high) = log_limit;
      const double wanted = (target.bytes ? 1.6 : -1.9) * std::log(std::clamp(ratio, 1e-3, 1e3) / 0.993);
      const double next = log_limit + std::clamp(wanted, -4.0, 4.0);
      log_limit = next > low + 0.05 * (high - low) && next < high - 0.05 * (high - low) ? next : (low + high) / 2;
    }
    if (best_.empty()) fail();
    return std::move(best_);
  }

 private:
  static double first_guess(const CodecTarget& target) {
    const double mean = target.mean_error_cm ? *target.mean_error_cm : *target.max_error_cm / 5;
    return std::clamp(20 * mean * mean, 1e-7, 1e5);
  }
  // Joints held to fewer turns than they make are off by up to this.
  static double tolerance(const CodecTarget& target) {
    const double cm = target.mean_error_cm ? *target.mean_error_cm : target.max_error_cm ? *target.max_error_cm / 3 : 1;
    return std::clamp(0.1 * cm, 1e-5, 0.01);
  }

  double attempt(double limit) {
    plan_.limit = limit;
    QbcEncoder::Result result = encoder_.encode(plan_, options_.progress);
    const CodecTarget& target = options_.target;
    const double ratio = target.bytes ? static_cast<double>(result.stream.size()) / static_cast<double>(*target.bytes)
                         : target.mean_error_cm ? result.error.mean_joint_error_cm / *target.mean_error_cm
                                                : result.error.max_joint_error_cm / *target.max_error_cm;
    if (ratio <= 1 && ratio > best_ratio_) {
      best_ratio_ = ratio;
      best_ = std::move(result.stream);
    }
    return ratio;
  }

  [[noreturn]] void fail() const {
    const CodecTarget& target = options_.target;
    if (target.bytes) cannot_meet(fmt::format("{} bytes", *target.bytes), "more; names and skeleton alone take that");
    if (target.mean_error_cm) cannot_meet(fmt::format("a mean joint error of {} cm", *target.mean_error_cm), "more");
    cannot_meet(fmt::format("a largest joint error of {} cm", *target.max_error_cm), "more");
  }

  QbcEncoder encoder_;
  Plan plan_;
  const CodecOptions& options_;
  Bytes best_;
  double best_ratio_ = -1;
};

}  // namespace

std::span<const CodecSetting> QbcCodec::settings() const {
  return qbc_settings;
}

Bytes QbcCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const Plan plan{.limit = setting(options, "max_squared_distance"),
                  .interval = static_cast<int>(setting(options, "interval")),
                  .root_unit = setting(options, "root_unit"),
                  .paper = setting(options, "merge") < 0.5,
                  .rate_weight = setting(options, "rate_weight")};
  if (options.target.any()) return LimitSearch(clips, plan, options).find();
  const double tolerance = std::clamp(0.02 * std::sqrt(plan.limit), 1e-5, 0.01);
  QbcEncoder::Result result = QbcEncoder(clips, tolerance).encode(plan, options.progress);
  if (!result.kept) cannot_meet(fmt::format("max_squared_distance = {}", plan.limit), "a larger one");
  return std::move(result.stream);
}

}  // namespace kinespace
