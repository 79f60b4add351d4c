// Decoding of qbc streams.
#include <algorithm>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/detail/qbc_stream.h"
#include "kinespace/codecs/qbc/qbc_codec.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/pose_vectors.h"

namespace kinespace {
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
      write_joint(clip, static_cast<std::size_t>(found - curves_.layout.joints.begin()), first, count, out);
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
    for (std::size_t j = 0; j < curves_.layout.joints.size(); ++j) write_joint(clip, j, first, count, out);
    return out;
  }

  static void copy_frame(const Clip& from, int frame, Clip& to) {
    for (int j = 0; j < to.skeleton.joint_count(); ++j) to.set_rotation(j, frame, from.rotation(j, 0));
    for (const Clip::TranslationTrack& track : from.translations) {
      to.require_translation_track(track.joint).values[static_cast<std::size_t>(frame)] = track.values.front();
    }
  }

  void write_joint(std::size_t clip, std::size_t joint, int first, int count, Clip& out) const {
    thread_local std::vector<double> values;
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
