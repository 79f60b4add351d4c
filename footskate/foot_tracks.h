// Where the feet of a clip are over time: what detection, ground and measures look at.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "kinespace/footskate/feet.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {

using Path = std::vector<Eigen::Vector3d>;  // cm, world; one a frame

// The joints that can stand, in the order of Feet::foot_joints: left ankle, left toe, right ankle, right toe.
struct FootTracks {
  Feet feet;
  int frames = 0;
  double rate_hz = 0;
  std::array<Path, 4> at;  // empty for a toe that is not there
  std::array<Path, 2> hip;
  std::array<Path, 2> knee;
  Path root;
  std::vector<double> heading;  // radians: where the body faces, at right angles to the line of the hips, unwrapped

  [[nodiscard]] bool has(int slot) const { return !at[slot].empty(); }
  // The velocity at a frame, cm/s, by differences over the neighbouring frames.
  [[nodiscard]] Eigen::Vector3d velocity(const Path& path, int frame) const;
};

[[nodiscard]] FootTracks foot_tracks(const Clip& clip, const Feet& feet);

}  // namespace kinespace
