// Decoding of qbc streams.
#include <algorithm>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/qbc/detail/curve_choice.h"
#include "kinespace/codecs/qbc/detail/qbc_stream.h"
#include "kinespace/codecs/qbc/qbc_codec.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/pose_vectors.h"

namespace kinespace {
namespace {

class QbcReader final : public StreamReader {
 public:
  explicit QbcReader(Bitstream stream)
      : stream_(std::move(stream)),
        table_(unpack_clip_table(stream_.section("clips"), most_qbc_frames(stream_.size()), stream_.source())),
        curves_(unpack_curves(stream_.section("curves"), table_, stream_.source())) {
    if (stream_.has_section("padding")) static_cast<void>(stream_.section("padding"));
    for (const ClipEntry& clip : table_.clips) summaries_.push_back({clip.name, clip.rate_hz, clip.frames});
  }

  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] std::span<const ClipSummary> clips() const override { return summaries_; }
  [[nodiscard]] const Skeleton& skeleton(std::size_t clip) const override {
    return table_.skeletons[static_cast<std::size_t>(table_.clips[clip].skeleton)];
  }
  [[nodiscard]] bool decodes_joints() const override { return true; }

  [[nodiscard]] Clip decode(std::size_t clip, int first, int count, int /*level*/) const override {
    check_range(clip, first, count);
    Clip out = empty_clip(clip, first, count);
    for (std::size_t j = 0; j < curves_.layout.joints.size(); ++j) write_joint(clip, j, first, count, out);
    return out;
  }

  [[nodiscard]] std::vector<Clip> decode_all(int /*level*/) const override {
    std::vector<Clip> out(table_.clips.size());
    tbb::parallel_for(std::size_t{0}, out.size(),
                      [&](std::size_t c) { out[c] = decode(c, 0, table_.clips[c].frames, -1); });
    return out;
  }

  [[nodiscard]] Clip decode_joint(std::size_t clip, int joint, int first, int count) const override {
    check_range(clip, first, count);
    const auto found = std::ranges::find(curves_.layout.joints, joint, &JointFreedom::joint);
    if (found == curves_.layout.joints.end() && (joint < 0 || joint >= skeleton(clip).joint_count())) {
      throw Error(ErrorKind::usage, {.file = stream_.source(),
                                     .found = fmt::format("joint {}", joint),
                                     .expected = fmt::format("0 to {}", skeleton(clip).joint_count() - 1)});
    }
    Clip out = empty_clip(clip, first, count);
    if (found != curves_.layout.joints.end()) {
      write_joint(clip, static_cast<std::size_t>(found - curves_.layout.joints.begin()), first, count, out);
    }
    return out;
  }

  [[nodiscard]] std::vector<int> preview_frames(std::size_t clip) const override {
    const CurveShape shape = curves_.tables.shape(table_.clips[clip].frames, 1, 0, 0);
    std::vector<int> out;
    for (int i = 0; i <= shape.interval_count(); ++i) out.push_back(shape.common_break(i));
    return out;
  }

  [[nodiscard]] Clip decode_preview(std::size_t clip) const override {
    check_range(clip, 0, 1);
    const std::vector<int> frames = preview_frames(clip);
    const ClipEntry& entry = table_.clips[clip];
    const auto count = static_cast<int>(frames.size());
    Clip out = make_clip(entry.name, skeleton(clip), entry.rate_hz / curves_.tables.interval, count);
    for (int i = 0; i < count; ++i) copy_frame(empty_clip(clip, frames[static_cast<std::size_t>(i)], 1), i, out);
    for (std::size_t j = 0; j < curves_.layout.joints.size(); ++j) {
      const auto dimensions = static_cast<std::size_t>(curve_dimensions(curves_.layout, j));
      std::vector<double> values(dimensions * frames.size());
      if (dimensions > 0) {
        const std::vector<double> common = decode_common(shape(clip, j), view(clip, j).code, stream_.source());
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
    return curves_.tables.shape(table_.clips[clip].frames, curve_dimensions(curves_.layout, joint), curve.finer,
                                curve.grid_log);
  }

  void check_range(std::size_t clip, int first, int count) const {
    const bool there =
        clip < table_.clips.size() && first >= 0 && count >= 1 && first <= table_.clips[clip].frames - count;
    if (there) return;
    throw Error(ErrorKind::usage, {.file = stream_.source(),
                                   .found = fmt::format("{} frames from {} of clip {}", count, first, clip),
                                   .expected = "frames that the stream has"});
  }

  // At rest, with side tracks.
  [[nodiscard]] Clip empty_clip(std::size_t clip, int first, int count) const {
    const ClipEntry& entry = table_.clips[clip];
    Clip out = make_clip(entry.name, skeleton(clip), entry.rate_hz, count);
    out.require_translation_track(out.skeleton.travel_root());
    for (const SideTrack& track : entry.side_tracks) apply_side_track(track, first, out);
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
      const CodedCurve curve = decode_curve(shape(clip, joint), view(clip, joint).code, stream_.source());
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

  Bitstream stream_;
  ClipTable table_;
  QbcCurves curves_;
  std::vector<ClipSummary> summaries_;
};

}  // namespace

std::unique_ptr<StreamReader> QbcCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  return std::make_unique<QbcReader>(std::move(stream));
}

}  // namespace kinespace
