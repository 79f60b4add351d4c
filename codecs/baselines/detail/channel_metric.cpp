#include "kinespace/codecs/baselines/detail/channel_metric.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr int most_poses = 12;
constexpr double difference = 1e-3;  // degrees or cm
constexpr double shell_cm = 3;

// Positions and weighted shell points of all joints, as one vector.
Eigen::VectorXd body(const std::vector<JointFrame>& joints) {
  const double scale = std::sqrt(1 / static_cast<double>(joints.size()));
  const double shell_scale = scale * std::sqrt(shell_weight / 3);
  Eigen::VectorXd out(static_cast<Eigen::Index>(12 * joints.size()));
  Eigen::Index at = 0;
  for (const JointFrame& joint : joints) {
    out.segment<3>(at) = scale * joint.position;
    const Eigen::Matrix3d axes = shell_cm * joint.rotation.toRotationMatrix();
    for (int k = 0; k < 3; ++k) out.segment<3>(at + 3 + 3 * k) = shell_scale * (joint.position + axes.col(k));
    at += 12;
  }
  return out;
}

}  // namespace

Eigen::MatrixXd channel_metric(const Clip& clip, const ChannelLayout& layout, const ChannelCurves& curves) {
  const int channels = layout.channel_count();
  const int poses = std::min(curves.frames, most_poses);
  // One frame as it is, and one for each channel that has moved.
  Clip moved = make_clip({}, clip.skeleton, clip.rate_hz, channels + 1);
  const auto columns = static_cast<std::size_t>(channels) + 1;
  std::vector<double> values(static_cast<std::size_t>(channels) * columns);
  std::vector<JointFrame> joints;
  Eigen::MatrixXd jacobian(12 * clip.skeleton.joint_count(), channels);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(channels, channels);
  for (int p = 0; p < poses; ++p) {
    const auto frame = static_cast<std::size_t>((2LL * p + 1) * curves.frames / (2LL * poses));
    for (int c = 0; c < channels; ++c) {
      const auto row = static_cast<std::size_t>(c);
      std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(row * columns), columns, curves.channel(c)[frame]);
      values[row * columns + row + 1] += difference;
    }
    write_channels(layout, values, 0, channels + 1, moved);
    world_frames(moved, 0, joints);
    const Eigen::VectorXd here = body(joints);
    for (int c = 0; c < channels; ++c) {
      world_frames(moved, c + 1, joints);
      jacobian.col(c) = (body(joints) - here) / difference;
    }
    out += jacobian.transpose() * jacobian;
  }
  return out / poses;
}

}  // namespace kinespace
