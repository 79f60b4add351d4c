// From what the feet must do to what the legs and the root shall.
#pragma once

#include <array>
#include <vector>

#include "kinespace/footskate/detail/leg_pose.h"
#include "kinespace/footskate/plants.h"

namespace kinespace {

// Ankles where the tasks say and carried over between, no foot under its floor, for a root that moves by `shift`
// (detail/root_path.h).
[[nodiscard]] LegGoals leg_goals(const FootTracks& tracks, const std::array<FloorUnder, 2>& floors,
                                 const std::array<FootTask, 2>& tasks, std::vector<Eigen::Vector3d> shift);

}  // namespace kinespace
