// Feet that go where they are told, the body with them.
//
// What cleanup does with the plants that it finds, for those who know where the feet shall be: at the frames that a task
// marks as planted an ankle is displaced and its foot turned as told; between them the leg carries the change over
// smoothly (join_between in footskate/plants.h); the root moves, smoothly, where a planted leg would not reach; no foot
// goes under the ground. Two-bone inverse kinematics does the rest (footskate/two_bone_ik.h).
#pragma once

#include <array>
#include <vector>

#include "kinespace/footskate/plants.h"

namespace kinespace {

struct GuidedFeet {
  std::array<FootTask, 2> tasks;   // an entry a frame
  std::vector<double> root_share;  // how much of its shift the root takes, an entry a frame, 0 to 1
};

// `tracks` are those of the clip. Ankles of nearly straight legs give by millimetres along the leg, so that no knee jerks.
void guide_feet(Clip& clip, const FootTracks& tracks, const Ground& ground, const GuidedFeet& guide);

}  // namespace kinespace
