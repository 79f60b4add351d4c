#include "kinespace/footskate/foot_tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kinespace/motion/position_blocks.h"

namespace kinespace {
namespace {

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
  FootTracks out{.feet = feet, .frames = clip.frames, .rate_hz = clip.rate_hz};
  const auto joints = feet.foot_joints();
  std::vector<std::pair<int, Path*>> paths = {{feet.root, &out.root}};
  for (std::size_t slot = 0; slot < joints.size(); ++slot) paths.emplace_back(joints[slot], &out.at[slot]);
  for (std::size_t side = 0; side < 2; ++side) {
    paths.emplace_back(feet.legs[side].hip, &out.hip[side]);
    paths.emplace_back(feet.legs[side].knee, &out.knee[side]);
  }
  std::erase_if(paths, [](const auto& path) { return path.first < 0; });
  for (auto& [joint, path] : paths) path->reserve(clip.frames);
  for_each_position_block(clip, 0, [&](int, const JointPositions& positions) {
    for (auto& [joint, path] : paths) {
      for (int f = 0; f < positions.frames; ++f) path->push_back(positions.at(f, joint));
    }
  });
  out.heading = headings(out.hip[0], out.hip[1]);
  return out;
}

}  // namespace kinespace
