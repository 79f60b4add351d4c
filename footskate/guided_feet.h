// Feet that go where they are told, the body with them.
//
// What cleanup does with the plants that it finds, for those who know where the feet shall be: at the frames that a task
// marks as planted an ankle is displaced and its foot turned as told; between them the leg carries the change over
// smoothly (join_between in footskate/plants.h); the root moves, smoothly, where a planted leg would not reach; no foot
// goes under the ground. Two-bone inverse kinematics does the rest (footskate/two_bone_ik.h).
#pragma once

#include <array>

#include "kinespace/footskate/plants.h"

namespace kinespace {

// `tracks` are those of the clip, the tasks one a leg with an entry a frame.
void guide_feet(Clip& clip, const FootTracks& tracks, const Ground& ground, const std::array<FootTask, 2>& tasks);

}  // namespace kinespace
