#include "bench/codec_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/codecs/registry.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr std::array<int, 3> zyx{2, 1, 0};

// What a codec's quality is set by, from fine to coarse.
struct Quality {
  std::string_view codec;
  std::string_view setting;
  std::vector<double> values;
};

const std::vector<Quality>& qualities() {
  static const std::vector<Quality> all{
      {"motion-space", "step", {0.35, 0.7, 1.4, 2.8, 5.6, 11, 16, 22}},
      {"qbc", "max_squared_distance", {2, 4, 7, 12, 18, 28, 50, 100, 200, 400}},
      {"pca", "components", {40, 32, 26, 22, 18, 15, 13, 11, 9, 7, 5}},
      {"dwt", "threshold", {0.5, 0.7, 1, 1.4, 2, 3, 4, 5.5, 7, 10, 15, 20, 30}},
      {"awt", "coefficients", {2500, 1280, 640, 320, 200, 120, 80, 60, 45, 35, 25, 18, 12}},
      {"fourier", "tolerance", {0.01, 0.02, 0.04, 0.08, 0.16, 0.32}},
      {"legendre", "tolerance", {0.01, 0.02, 0.04, 0.08, 0.16, 0.32}},
  };
  return all;
}

double squared(double x) {
  return x * x;
}

// Of one joint's rotations in one frame, in degrees squared.
double squared_angles(const EulerOrder& order, const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const EulerAngles original = euler_angles(order, a);
  const EulerAngles decoded = euler_angles(order, b, original);
  double out = 0;
  for (std::size_t i = 0; i < 3; ++i) out += squared(original[i] - decoded[i]);
  return out;
}

// How the rotation of a joint is told in the file.
struct FileChannels {
  EulerOrder order;
  Eigen::Quaterniond axis = Eigen::Quaterniond::Identity();
  int count = 0;
};

FileChannels file_channels(const SweepClip& clip, int joint) {
  const Joint& one = clip.clip.skeleton.joints[static_cast<std::size_t>(joint)];
  FileChannels out{.order = euler_order(one.channels), .count = static_cast<int>(one.channels.size())};
  if (clip.asf && joint > 0) {
    const Asf::Bone& bone = clip.asf->bones[static_cast<std::size_t>(joint)];
    out = {.order = {.axes = zyx, .given = 3}, .axis = bone.axis, .count = static_cast<int>(bone.dofs.size())};
  } else if (clip.asf) {
    out.order = {.axes = clip.asf->root_axes, .given = 3};
  }
  return out;
}

}  // namespace

SweepClip read_sweep_clip(const std::filesystem::path& path) {
  SweepClip out{
      .clip = read_clip(path), .asf = {}, .text_bytes = static_cast<double>(std::filesystem::file_size(path))};
  for (const auto& file : files_read(path)) {
    if (file.extension() == ".asf" || file.extension() == ".ASF") out.asf = read_asf(file);
  }
  return out;
}

double channel_mse(const SweepClip& original, const Clip& decoded) {
  const Clip& clip = original.clip;
  const double cm_per_unit = original.asf ? original.asf->cm_per_unit : 1;
  double sum = 0;
  int channels = 0;
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    const FileChannels file = file_channels(original, j);
    channels += file.count;
    for (int f = 0; f < clip.frames; ++f) {
      if (clip.skeleton.joints[static_cast<std::size_t>(j)].has_rotation()) {
        sum += squared_angles(file.order, file.axis.conjugate() * clip.rotation(j, f) * file.axis,
                              file.axis.conjugate() * decoded.rotation(j, f) * file.axis);
      }
      sum += (clip.translation(j, f) - decoded.translation(j, f)).squaredNorm() / squared(cm_per_unit);
    }
  }
  return sum / (static_cast<double>(clip.frames) * std::max(channels, 1));
}

CodecPoint measure_codec(const SweepClip& clip, const Codec& codec, const CodecOptions& options) {
  const Bytes stream = encode(codec.name(), std::span(&clip.clip, 1), options);
  const Clip decoded = open_stream(stream, clip.clip.name)->decode(0);
  const MotionError error = compare(clip.clip, decoded);
  const auto bytes = static_cast<double>(stream.size());
  return {.codec = std::string(codec.name()),
          .bytes = bytes,
          .frames = static_cast<double>(clip.clip.frames),
          .mse = channel_mse(clip, decoded),
          .text_ratio = clip.text_bytes / bytes,
          .raw_ratio = raw_bytes(clip.clip) / bytes,
          .mean_joint_error_cm = error.mean_joint_error_cm,
          .max_joint_error_cm = error.max_joint_error_cm,
          .shell_error_cm = error.shell_error_cm,
          .mean_rotation_error_deg = error.mean_rotation_error_deg,
          .kg = error.kg,
          .kg_time = error.kg_time};
}

std::vector<CodecPoint> sweep_codec(const SweepClip& clip, const Codec& codec) {
  const auto quality = std::ranges::find(qualities(), codec.name(), &Quality::codec);
  if (quality == qualities().end()) return {measure_codec(clip, codec, {})};
  std::vector<CodecPoint> out;
  for (const double value : quality->values) {
    out.push_back(measure_codec(clip, codec, {.settings = {{std::string(quality->setting), value}}}));
    out.back().setting = fmt::format("{}={}", quality->setting, value);
    out.back().value = value;
  }
  return out;
}

std::optional<double> ratio_at(std::span<const CodecPoint> points, double mse) {
  std::vector<CodecPoint> sorted(points.begin(), points.end());
  std::ranges::sort(sorted, {}, &CodecPoint::mse);
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const CodecPoint& a = sorted[i - 1];
    const CodecPoint& b = sorted[i];
    if (!(a.mse <= mse && mse <= b.mse) || a.mse <= 0) continue;
    const double share = b.mse > a.mse ? std::log(mse / a.mse) / std::log(b.mse / a.mse) : 0;
    return std::exp(std::log(a.text_ratio) + share * (std::log(b.text_ratio) - std::log(a.text_ratio)));
  }
  return {};
}

}  // namespace kinespace
