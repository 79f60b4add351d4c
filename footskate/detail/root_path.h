// Where the root goes so that every planted leg reaches.
#pragma once

#include <array>
#include <vector>

#include "kinespace/footskate/plants.h"

namespace kinespace {

// The shift of the root, cm, world, one a frame: the smoothest (least third derivative, over about 0.1 s) that stays
// near the displacements of the planted ankles, nearest along legs that are nearly straight, so that their knees bend
// as they did; and pulls in where a planted leg would be longer than 99 % of its length, or than it was where that is
// more.
[[nodiscard]] std::vector<Eigen::Vector3d> root_shift(const FootTracks& tracks, const std::array<FootTask, 2>& tasks);

}  // namespace kinespace
