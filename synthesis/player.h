// Playback of a clip in a motion space, pose by pose: at any time, in any order, with as many functions as the moment
// asks for (an engine's level of detail by distance), without decoding the clip.
//
// A pose is, for each rotating joint, the sum over the first n functions of coefficient times function value - a few
// products, since functions are tabulated (synthesis/playback_basis.h) - renormalised; the root's place is the same of
// their integrals. At the times of frames it is what decode(space, clip, n) gives, to rounding in float (0.001 cm, 1e-5
// rad), joins at cuts included; between frames it is the same curves, so it is continuous across cuts at every level.
// Only breaks of the recording, where decode() jumps too, are jumps: a time between the two frames beside a break gets
// the nearer one.
//
// A pose of 30 joints at 5 functions takes 0.15 microseconds, 0.3 when its memory is cold, and nothing is allocated.
// Poses may be asked for from several threads. Memory: coefficients as floats, and for each cut, level and curve two
// more.
//
// What is not played: side tracks (translations of joints below the root; the joints above the travel root are folded
// into the root's place and orientation). decode() has them.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/fpca/encoding.h"
#include "kinespace/synthesis/playback_basis.h"

namespace kinespace {

struct PlayerOptions {
  bool loop = false;  // times beyond the ends start over (from the clip's first frame); else they get the end's pose
  JoinOptions join;   // as in decode()
};

struct PlayerParts;

class Player {
 public:
  // `clip` must be in the space of the basis. Throws Error{usage} when it has other curves.
  Player(std::shared_ptr<const PlaybackBasis> basis, const EncodedClip& clip, const PlayerOptions& options = {});
  Player(const RegisteredSpace& space, const EncodedClip& clip, const PlayerOptions& options = {});

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] int joints() const;
  [[nodiscard]] int functions() const;
  // The frame that is played at a time, between 0 and the last: with `loop` times beyond the ends start over.
  [[nodiscard]] double frame_at(double time_s) const;

  // The pose at a time in seconds from the clip's first frame, at level of detail `functions` (all when < 0 or too
  // large). `rotations`: 4 * joints() floats, w x y z of each of Skeleton::rotating_joints() in its parent's frame,
  // the travel root first, whose orientation is that in the world. Returns the world position of the travel root in cm.
  Eigen::Vector3f pose(double time_s, int functions, std::span<float> rotations) const;

 private:
  friend struct PlayerParts;  // synthesis/detail/player_parts.h

  std::shared_ptr<const PlayerParts> parts_;
};

namespace reference {
// Player::pose with plain loops, curve by curve: the same numbers to rounding, and the only way for spaces in which
// every curve has functions of its own.
Eigen::Vector3f pose(const Player& player, double time_s, int functions, std::span<float> rotations);
}  // namespace reference

}  // namespace kinespace
