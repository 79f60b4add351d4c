#include "kinespace/fpca/pose_features.h"

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

Eigen::Quaterniond quaternion(const SampleMatrix& values, Eigen::Index row, int joint) {
  const auto q = values.row(row).segment<4>(3 + 4 * joint);
  return Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
}

}  // namespace

PoseFeatureSource::PoseFeatureSource(const ClipCurves& curves, const Skeleton& skeleton,
                                     const PoseFeatureOptions& options)
    : curves_(curves),
      step_(curves.rate_hz / options.rate_hz),
      rows_(curves.frames()),
      root_weight_(std::sqrt(options.root_weight)) {
  if (std::abs(step_ - 1) < 1e-9) {
    step_ = 1;
  } else {
    rows_ = std::max(1, static_cast<int>(std::floor((curves.frames() - 1) / step_ + 1e-9)) + 1);
  }
  const CurveLayout layout = curve_layout(skeleton);
  weight_ = {std::sqrt(options.hip_weight)};
  for (int k = 1; k < layout.joint_count(); ++k) {
    weight_.push_back(std::sqrt(bone_length_m(skeleton, layout.joints[static_cast<std::size_t>(k)])));
  }
}

SampleMatrix PoseFeatureSource::keyframes(int first, int count) const {
  if (step_ == 1) return curves_.values.middleRows(first, count);
  SampleMatrix out(count, curves_.values.cols());
  for (int i = 0; i < count; ++i) {  // linear: what matters here is the pose, not its smoothness
    const double x = std::min((first + i) * step_, static_cast<double>(curves_.frames() - 1));
    const auto f = std::min(static_cast<int>(x), std::max(0, curves_.frames() - 2));
    const double b = x - f;
    const int next = std::min(f + 1, curves_.frames() - 1);
    out.row(i) = (1 - b) * curves_.values.row(f) + b * curves_.values.row(next);
  }
  return out;
}

void PoseFeatureSource::write(const SampleMatrix& keys, int first_key, int row, float* out) const {
  // Not along a likely bone axis, where a twist would not be seen.
  const Eigen::Vector3d u = Eigen::Vector3d(1, 1, 1).normalized();
  Eigen::Map<Eigen::VectorXf> features(out, dims());
  // The last keyframe moves on as the one before it did.
  const int now = std::min(row, std::max(0, rows_ - 2)) - first_key;
  const int next = std::min(now + first_key + 1, rows_ - 1) - first_key;
  const Eigen::Vector3d step = (keys.row(next) - keys.row(now)).head<3>().transpose();
  const Eigen::Quaterniond turn = quaternion(keys, next, 0) * quaternion(keys, now, 0).conjugate();
  features.segment<3>(0) = (root_weight_ * step).cast<float>();
  features.segment<3>(3) = (weight_[0] * (turn * u)).cast<float>();
  const int here = row - first_key;
  const int after = std::min(row + 1, rows_ - 1) - first_key;
  for (int k = 1; k < static_cast<int>(weight_.size()); ++k) {
    const double weight = weight_[static_cast<std::size_t>(k)];
    features.segment<3>(6 * k) = (weight * (quaternion(keys, here, k) * u)).cast<float>();
    features.segment<3>(6 * k + 3) = (weight * (quaternion(keys, after, k) * u)).cast<float>();
  }
}

void PoseFeatureSource::append(int first, int count, std::vector<float>& out) const {
  constexpr int block = 256;
  const auto dims_each = static_cast<std::size_t>(dims());
  std::size_t at = out.size();
  out.resize(at + static_cast<std::size_t>(count) * dims_each);
  for (int done = 0; done < count; done += block) {
    const int row = first + done;
    const int end = std::min(row + block, first + count);
    const int first_key = std::max(0, row - 1);
    const SampleMatrix keys = keyframes(first_key, std::min(end + 1, rows_) - first_key);
    for (int i = row; i < end; ++i, at += dims_each) write(keys, first_key, i, out.data() + at);
  }
}

PoseFeatures pose_features(const ClipCurves& curves, const Skeleton& skeleton, const PoseFeatureOptions& options) {
  const PoseFeatureSource source(curves, skeleton, options);
  PoseFeatures out{source.rows(), source.dims(), {}};
  source.append(0, source.rows(), out.values);
  return out;
}

PoseFeatures pose_features(const Clip& clip, const PoseFeatureOptions& options) {
  return pose_features(clip_curves(clip), clip.skeleton, options);
}

}  // namespace kinespace
