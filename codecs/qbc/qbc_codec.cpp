// The encoder and the decoder of the qbc codec.
#include "kinespace/codecs/qbc/qbc_codec.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/detail/pole_corrections.h"
#include "kinespace/codecs/qbc/detail/qbc_stream.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/pose_vectors.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

constexpr std::array qbc_settings{
    CodecSetting{"max_squared_distance", 18, 1e-8, 1e6,
                 "limit d^2 of a joint's squared distance in every frame, in squared degrees (root units)"},
    CodecSetting::whole("interval", 160, 1, longest_segment, "frames between the breaks that all joints have"),
    CodecSetting{"root_unit", 5.6444F, 1e-3, 1e3, "cm of the root's position that count as a degree"},
    CodecSetting::flag("merge", true, "breaks chosen by error and bits; off: the paper's rule alone"),
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
      : clips_(clips),
        layout_(find_channel_layout(clips, {.tolerance_degrees = tolerance_degrees})),
        table_(clip_table_of(clips)),
        packed_clips_(pack_clip_table(table_)) {
    for (const Clip& clip : clips) {
      channels_.push_back(channel_curves(clip, layout_));
      require_channels_below(1e6, channels_.back(), clip.name);
    }
    for (std::size_t c = 0; c < clips.size(); ++c) {
      for (std::size_t j = 0; j < layout_.joints.size(); ++j) {
        if (curve_dimensions(layout_, j) > 0) curves_.emplace_back(c, j);
      }
    }
  }

  // `kept`: whether every joint is within the limit.
  [[nodiscard]] CodedAttempt encode(const Plan& plan, const Progress& progress, bool* kept = nullptr) const {
    const QbcTables tables{
        .interval = plan.interval, .step_index = step_index_of(plan), .root_unit = static_cast<float>(plan.root_unit)};
    std::vector<QbcCurve> coded(curves_.size());
    std::atomic<bool> all_kept = true;
    parallel_for(std::size_t{0}, curves_.size(), [&](std::size_t i) {
      progress.check_stop();
      const auto [clip, joint] = curves_[i];
      const CurveTask wanted = task(clip, joint, plan, tables);
      CurveChoice choice = choose_curve(wanted, plan.paper);
      if (joint == 0 && !plan.paper) correct_poles(clip, wanted, choice);
      if (choice.error.largest > plan.limit) all_kept = false;
      coded[i] = {.finer = choice.task.step_index - tables.step_index,
                  .grid_log = bit_length(static_cast<std::uint64_t>(choice.task.grid)) - 1,
                  .code = choice.code};
    });
    if (kept != nullptr) *kept = all_kept;
    const Bytes curves = pack_curves(tables, layout_, coded);
    return write_measured(
        clips_, [&](const MeasuredError& error) { return write(curves, error); },
        [](Bitstream stream) { return QbcCodec().open(std::move(stream)); });
  }

 private:
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
    add_padding(out, packed_clips_.size() + curves.size(), table_.frames());
    return out.finish();
  }

  std::span<const Clip> clips_;
  ChannelLayout layout_;
  ClipTable table_;
  Bytes packed_clips_;
  std::vector<ChannelCurves> channels_;
  std::vector<std::pair<std::size_t, std::size_t>> curves_;  // clip, joint
};

// Joints held to fewer turns than they make are off by up to this.
double tolerance_for(const CodecTarget& target) {
  const double cm = target.mean_error_cm ? *target.mean_error_cm : target.max_error_cm ? *target.max_error_cm / 3 : 1;
  return std::clamp(0.1 * cm, 1e-5, 0.01);
}

// A coarseness is the mean error that may be expected, in cm: the limit is of its square.
double limit_for(double coarseness) {
  return 20 * coarseness * coarseness;
}

Bytes meet(const CodecTarget& target, std::span<const Clip> clips, Plan plan, const Progress& progress) {
  const QbcEncoder encoder(clips, tolerance_for(target));
  SearchRange range{.start = 1, .least = 3e-5, .most = 200, .rounds = 13};
  if (target.mean_error_cm) range.start = std::clamp(*target.mean_error_cm, range.least, range.most);
  if (target.max_error_cm) range.start = std::clamp(*target.max_error_cm / 5, range.least, range.most);
  return search_target(target, range, [&](double coarseness) {
    plan.limit = limit_for(coarseness);
    return encoder.encode(plan, progress);
  });
}

}  // namespace

std::span<const CodecSetting> QbcCodec::settings() const {
  return qbc_settings;
}

Bytes QbcCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const Plan plan{.limit = setting(options, "max_squared_distance"),
                  .interval = static_cast<int>(setting(options, "interval")),
                  .root_unit = setting(options, "root_unit"),
                  .paper = !flag(options, "merge"),
                  .rate_weight = setting(options, "rate_weight")};
  if (options.target.any()) return meet(options.target, clips, plan, options.progress);
  const double tolerance = std::clamp(0.02 * std::sqrt(plan.limit), 1e-5, 0.01);
  bool kept = true;
  CodedAttempt result = QbcEncoder(clips, tolerance).encode(plan, options.progress, &kept);
  if (!kept) cannot_meet(fmt::format("max_squared_distance = {}", plan.limit), "a larger one");
  return std::move(result.stream);
}

namespace {

class QbcReader final : public ClipReader {
 public:
  explicit QbcReader(Bitstream bits)
      : ClipReader(std::move(bits)), curves_(unpack_curves(stream().section("curves"), table(), stream().source())) {}

  [[nodiscard]] bool decodes_joints() const override { return true; }

  [[nodiscard]] Clip decode_joint(std::size_t clip, int joint, int first, int count) const override {
    require_frames(clip, first, count);
    const auto found = std::ranges::find(curves_.layout.joints, joint, &JointFreedom::joint);
    if (found == curves_.layout.joints.end() && (joint < 0 || joint >= skeleton(clip).joint_count())) {
      throw Error(ErrorKind::usage, {.file = stream().source(),
                                     .found = fmt::format("joint {}", joint),
                                     .expected = fmt::format("0 to {}", skeleton(clip).joint_count() - 1)});
    }
    Clip out = at_rest(clip, first, count);
    if (found != curves_.layout.joints.end()) {
      std::vector<double> values;
      write_joint(clip, static_cast<std::size_t>(found - curves_.layout.joints.begin()), first, count, values, out);
    }
    return out;
  }

  [[nodiscard]] std::vector<int> preview_frames(std::size_t clip) const override {
    const CurveShape shape = curves_.tables.shape(entry(clip).frames, 1, 0, 0);
    std::vector<int> out;
    for (int i = 0; i <= shape.interval_count(); ++i) out.push_back(shape.common_break(i));
    return out;
  }

  [[nodiscard]] Clip decode_preview(std::size_t clip) const override {
    require_frames(clip, 0, 1);
    const std::vector<int> frames = preview_frames(clip);
    const auto count = static_cast<int>(frames.size());
    Clip out = make_clip(entry(clip).name, skeleton(clip), entry(clip).rate_hz / curves_.tables.interval, count);
    for (int i = 0; i < count; ++i) copy_frame(at_rest(clip, frames[static_cast<std::size_t>(i)], 1), i, out);
    for (std::size_t j = 0; j < curves_.layout.joints.size(); ++j) {
      const auto dimensions = static_cast<std::size_t>(curve_dimensions(curves_.layout, j));
      std::vector<double> values(dimensions * frames.size());
      if (dimensions > 0) {
        const std::vector<double> common = decode_common(shape(clip, j), view(clip, j).code, stream().source());
        for (std::size_t i = 0; i < values.size(); ++i) {
          values[i % dimensions * frames.size() + i / dimensions] = common[i];
        }
      }
      write_values(j, values, count, out);
    }
    return out;
  }

 private:
  [[nodiscard]] const QbcCurveView& view(std::size_t clip, std::size_t joint) const {
    return curves_.curves[clip * curves_.layout.joints.size() + joint];
  }
  [[nodiscard]] CurveShape shape(std::size_t clip, std::size_t joint) const {
    const QbcCurveView& curve = view(clip, joint);
    return curves_.tables.shape(entry(clip).frames, curve_dimensions(curves_.layout, joint), curve.finer,
                                curve.grid_log);
  }

  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int /*level*/) const override {
    Clip out = at_rest(clip, first, count);
    std::vector<double> values;
    for (std::size_t j = 0; j < curves_.layout.joints.size(); ++j) write_joint(clip, j, first, count, values, out);
    return out;
  }

  static void copy_frame(const Clip& from, int frame, Clip& to) {
    for (int j = 0; j < to.skeleton.joint_count(); ++j) to.set_rotation(j, frame, from.rotation(j, 0));
    for (const Clip::TranslationTrack& track : from.translations) {
      to.require_translation_track(track.joint).values[static_cast<std::size_t>(frame)] = track.values.front();
    }
  }

  // `values`: scratch.
  void write_joint(std::size_t clip, std::size_t joint, int first, int count, std::vector<double>& values,
                   Clip& out) const {
    values.clear();
    const int dimensions = curve_dimensions(curves_.layout, joint);
    if (dimensions > 0) {
      const CodedCurve curve = decode_curve(shape(clip, joint), view(clip, joint).code, stream().source());
      evaluate(curve, dimensions, first, count, values);
    }
    write_values(joint, values, count, out);
  }

  // All frames of `out` from [dimension][count].
  void write_values(std::size_t joint, std::span<double> values, int count, Clip& out) const {
    const auto n = static_cast<std::size_t>(count);
    std::size_t turns = 0;
    if (joint == 0) {
      turns = 3 * n;
      for (double& v : values.first(turns)) v *= static_cast<double>(curves_.tables.root_unit);
      write_root_position(values.first(turns), 0, count, out);
    }
    write_joint_channels(curves_.layout.joints[joint], values.subspan(turns), 0, count, out);
  }

  QbcCurves curves_;
};

}  // namespace

std::unique_ptr<StreamReader> QbcCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  return std::make_unique<QbcReader>(std::move(stream));
}

}  // namespace kinespace
