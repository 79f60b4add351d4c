#include "kinespace/footskate/guided_feet.h"

#include <utility>

#include "kinespace/footskate/detail/leg_goals.h"
#include "kinespace/footskate/detail/root_path.h"

namespace kinespace {

void guide_feet(Clip& clip, const FootTracks& tracks, const Ground& ground, const GuidedFeet& guide) {
  const std::array<FloorUnder, 2> floors{FloorUnder(tracks, ground, {}, 0), FloorUnder(tracks, ground, {}, 1)};
  std::vector<Eigen::Vector3d> shift = root_shift(tracks, guide.tasks);
  for (std::size_t f = 0; f < shift.size(); ++f) shift[f] *= guide.root_share[f];
  LegGoals goals = leg_goals(tracks, floors, guide.tasks, std::move(shift));
  goals.give_cm = 0.15;
  pose_legs(clip, tracks.feet, goals);
}

}  // namespace kinespace
