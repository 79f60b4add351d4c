// Which foot stands where and when while one motion goes over into another, and the legs put there.
//
// A foot does what the first motion's does until some frame of the overlap, and what the second motion's does from there
// on. A foot that stands in both is held if both places are near: it keeps its place, and what it is from that of the
// second motion goes with its next step. Else it makes a step, with lift, long enough for the way. The frames at which
// both feet change over are those with the least cost: ways that feet must go, times without support that neither motion
// has.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

// What the feet of a motion do over frames of the output, as if it were played alone.
struct FeetOver {
  std::array<std::vector<JointFrame>, 2> ankles;  // by leg, then frame: world
  std::array<std::vector<char>, 2> stands;        // whether ankle or toe stands
};

// A stretch of the output around an overlap: [begin, end) are the overlap's frames. Before it the motion is the first,
// after it the second.
struct SeamFeet {
  int frames = 0;
  int begin = 0, end = 0;
  double rate_hz = 0;
  FeetOver first, second;  // that of the first stays as it last was after the overlap
};

struct LegSteps {
  int last_of_first = -1;   // the last frame that is given by the first motion
  int first_of_second = 0;  // the first that is given by the second
  bool held = false;        // it stands all the time between
  double way_cm = 0;        // along the ground between these two
};

struct Footsteps {
  std::array<LegSteps, 2> legs;
  double cost = 0;
};

// Steps last `pace` times as long as they usually do, 1 or more.
[[nodiscard]] Footsteps plan_footsteps(const SeamFeet& feet, double pace = 1);

// Puts the legs of the blend where the plan has them.
void take_footsteps(Clip& blend, const FootTracks& tracks, const Ground& ground, const SeamFeet& feet,
                    const Footsteps& plan);

// The ankles of a clip, by leg.
[[nodiscard]] std::array<std::vector<JointFrame>, 2> ankles_of(const Clip& clip, const Feet& feet);

}  // namespace kinespace
