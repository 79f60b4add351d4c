#include "kinespace/footskate/guided_feet.h"

#include "kinespace/footskate/detail/leg_goals.h"

namespace kinespace {

void guide_feet(Clip& clip, const FootTracks& tracks, const Ground& ground, const std::array<FootTask, 2>& tasks) {
  const std::array<FloorUnder, 2> floors{FloorUnder(tracks, ground, {}, 0), FloorUnder(tracks, ground, {}, 1)};
  pose_legs(clip, tracks.feet, leg_goals(tracks, floors, tasks));
}

}  // namespace kinespace
