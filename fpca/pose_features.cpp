#include "fpca/pose_features.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace kinespace {
namespace {

// The longest bone that starts at the joint, in metres: how far its rotation is seen.
double bone_length_m(const Skeleton& skeleton, int joint) {
  double longest = 0;
  const auto& end_site = skeleton.joints[static_cast<std::size_t>(joint)].end_site;
  if (end_site) longest = end_site->norm();
  for (const Joint& child : skeleton.joints) {
    if (child.parent == joint) longest = std::max(longest, child.offset.norm());
  }
  return longest / 100;
}

// The curves at `rate_hz`: every frame when the clip has that rate.
SampleMatrix keyframes(const ClipCurves& curves, double rate_hz) {
  const double step = curves.rate_hz / rate_hz;
  if (std::abs(step - 1) < 1e-9) return curves.values;
  const auto count = std::max(1, static_cast<int>(std::floor((curves.frames() - 1) / step + 1e-9)) + 1);
  SampleMatrix out(count, curves.values.cols());
  for (int i = 0; i < count; ++i) {  // linear: what matters here is the pose, not its smoothness
    const double x = std::min(i * step, static_cast<double>(curves.frames() - 1));
    const auto f = std::min(static_cast<int>(x), std::max(0, curves.frames() - 2));
    const double b = x - f;
    const int next = std::min(f + 1, curves.frames() - 1);
    out.row(i) = (1 - b) * curves.values.row(f) + b * curves.values.row(next);
  }
  return out;
}

Eigen::Quaterniond quaternion(const SampleMatrix& values, Eigen::Index row, int joint) {
  const auto q = values.row(row).segment<4>(3 + 4 * joint);
  return Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
}

}  // namespace

PoseFeatures pose_features(const ClipCurves& curves, const Skeleton& skeleton, const PoseFeatureOptions& options) {
  const CurveLayout layout = curve_layout(skeleton);
  const int joints = layout.joint_count();
  const SampleMatrix keys = keyframes(curves, options.rate_hz);
  PoseFeatures out{static_cast<int>(keys.rows()), 6 + 6 * (joints - 1), {}};
  out.values.resize(static_cast<std::size_t>(out.rows) * static_cast<std::size_t>(out.dims));

  // Not along a likely bone axis, where a twist would not be seen.
  const Eigen::Vector3d u = Eigen::Vector3d(1, 1, 1).normalized();
  std::vector<double> weight{std::sqrt(options.hip_weight)};
  for (int k = 1; k < joints; ++k) {
    weight.push_back(std::sqrt(bone_length_m(skeleton, layout.joints[static_cast<std::size_t>(k)])));
  }
  const double root_weight = std::sqrt(options.root_weight);

  for (int i = 0; i < out.rows; ++i) {
    float* row = out.values.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(out.dims);
    Eigen::Map<Eigen::VectorXf> features(row, out.dims);
    // The last keyframe moves on as the one before it did.
    const int now = std::min(i, std::max(0, out.rows - 2));
    const int next = std::min(now + 1, out.rows - 1);
    const Eigen::Vector3d step = (keys.row(next) - keys.row(now)).head<3>().transpose();
    const Eigen::Quaterniond turn = quaternion(keys, next, 0) * quaternion(keys, now, 0).conjugate();
    features.segment<3>(0) = (root_weight * step).cast<float>();
    features.segment<3>(3) = (weight[0] * (turn * u)).cast<float>();
    const int after = std::min(i + 1, out.rows - 1);
    for (int k = 1; k < joints; ++k) {
      features.segment<3>(6 * k) = (weight[static_cast<std::size_t>(k)] * (quaternion(keys, i, k) * u)).cast<float>();
      features.segment<3>(6 * k + 3) =
          (weight[static_cast<std::size_t>(k)] * (quaternion(keys, after, k) * u)).cast<float>();
    }
  }
  return out;
}

PoseFeatures pose_features(const Clip& clip, const PoseFeatureOptions& options) {
  return pose_features(clip_curves(clip), clip.skeleton, options);
}

}  // namespace kinespace
