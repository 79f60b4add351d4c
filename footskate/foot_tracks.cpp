#include "footskate/foot_tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kinespace {
namespace {

Path path_of(const JointPositions& positions, int joint) {
  Path out;
  if (joint < 0) return out;
  out.reserve(positions.frames);
  for (int f = 0; f < positions.frames; ++f) out.push_back(positions.at(f, joint));
  return out;
}

// A body with its left hip at +X of its right one faces +Z: heading 0.
std::vector<double> headings(const Path& left, const Path& right) {
  std::vector<double> out(left.size(), 0.0);
  double last = 0;
  for (std::size_t f = 0; f < left.size(); ++f) {
    const Eigen::Vector3d across = left[f] - right[f];
    const double raw = std::hypot(across.x(), across.z()) > 1e-6 ? std::atan2(-across.z(), across.x()) : last;
    last += std::remainder(raw - last, 2 * std::numbers::pi);
    out[f] = last;
  }
  return out;
}

}  // namespace

Eigen::Vector3d FootTracks::velocity(const Path& path, int frame) const {
  const int before = std::max(0, frame - 1);
  const int after = std::min(frames - 1, frame + 1);
  if (before == after) return Eigen::Vector3d::Zero();
  return (path[after] - path[before]) * (rate_hz / (after - before));
}

FootTracks foot_tracks(const Clip& clip, const Feet& feet) {
  const JointPositions positions = joint_positions(clip);
  FootTracks out{.feet = feet, .frames = clip.frames, .rate_hz = clip.rate_hz};
  const auto joints = feet.foot_joints();
  for (std::size_t slot = 0; slot < joints.size(); ++slot) out.at[slot] = path_of(positions, joints[slot]);
  for (std::size_t side = 0; side < 2; ++side) {
    out.hip[side] = path_of(positions, feet.legs[side].hip);
    out.knee[side] = path_of(positions, feet.legs[side].knee);
  }
  out.root = path_of(positions, feet.root);
  out.heading = headings(out.hip[0], out.hip[1]);
  return out;
}

}  // namespace kinespace
