// From what the feet must do to what the legs and the root shall.
#pragma once

#include <array>

#include "kinespace/footskate/detail/leg_pose.h"
#include "kinespace/footskate/plants.h"

namespace kinespace {

// The root moved so that planted legs reach, ankles where the tasks say and carried over between, no foot under its
// floor.
[[nodiscard]] LegGoals leg_goals(const FootTracks& tracks, const std::array<FloorUnder, 2>& floors,
                                 const std::array<FootTask, 2>& tasks);

}  // namespace kinespace
