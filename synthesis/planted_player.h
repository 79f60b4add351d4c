// Playback with feet that stand where those of the original stood (footskate/foot_planter.h), pose by pose.
//
// Below `planted_below` functions a pose is Player::pose with the legs turned: at the times of frames what plant_feet()
// makes of the decoded clip, but for rounding in float. From there on, and for clips that keep nothing of their feet, it
// is Player::pose itself.
//
// A pose at 5 functions takes two to two and a half times as long as without; nothing is allocated, and poses may be
// asked for from several threads and in any order. Memory: 24 bytes for each contact of the clip and level.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/footskate/foot_planter.h"
#include "kinespace/synthesis/player.h"

namespace kinespace {

class PlantedPlayer {
 public:
  // `clip` is the one that the player plays; `skeleton` has the bones that it was read with (LibraryView::skeleton).
  PlantedPlayer(Player player, const EncodedClip& clip, const Skeleton& skeleton);

  [[nodiscard]] const Player& player() const { return player_; }
  // Whether anything is ever planted.
  [[nodiscard]] bool plants() const { return legs_ != nullptr; }

  // As Player::pose.
  Eigen::Vector3f pose(double time_s, int functions, std::span<float> rotations) const;

 private:
  struct Legs;  // planted_player.cpp

  Player player_;
  std::shared_ptr<const Legs> legs_;  // null: nothing is planted
};

}  // namespace kinespace
