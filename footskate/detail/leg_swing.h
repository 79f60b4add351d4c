// Where an ankle goes between plants.
#pragma once

#include <vector>

#include "kinespace/footskate/plants.h"

namespace kinespace {

// The ankle's goals, cm, world, one a frame, for a root moved by `shift`. Planted: where it was plus the displacement.
// Between plants the leg carries over what it had to change, joined smoothly (join_between): the angle of its knee, and
// the direction from hip to ankle. Angles rather than places, since near full length a small step of the ankle would
// throw the knee.
[[nodiscard]] std::vector<Eigen::Vector3d> ankle_goals(const FootTracks& tracks, int leg, const FootTask& task,
                                                       const std::vector<Eigen::Vector3d>& shift);

}  // namespace kinespace
