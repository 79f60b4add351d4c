// What a foot does around one frame, as numbers that are near each other when the motions are: the keyframes of
// ikemoto 2006 ("Knowing When to Put Your Foot Down"), by which contacts are learnt.
#pragma once

#include <array>
#include <vector>

#include "kinespace/footskate/ground.h"

namespace kinespace {

// Ankle and toe at five times, 83 ms before to 83 ms after: across and ahead of the root in the body's heading, and
// over the ground (the ankle's over its standing height), in leg lengths, heights three times. The right foot is
// mirrored, so that one model serves both. None of these numbers feels the root path being scaled or shifted along the
// ground.
using Keyframe = std::array<float, 30>;

// The keyframes of one leg (0 left, 1 right) over all frames; empty for a foot without a toe joint. Times before the
// first and after the last frame count as these.
[[nodiscard]] std::vector<Keyframe> keyframes_of(const FootTracks& tracks, const Ground& ground, int leg);

[[nodiscard]] float squared_distance(const Keyframe& a, const Keyframe& b);

// The level under each foot joint's next and last stand: the ground; on uneven ground the lower of the rests of that
// foot before and after. cm, one a frame.
[[nodiscard]] std::vector<double> levels_under(const FootTracks& tracks, const Ground& ground, int leg);

}  // namespace kinespace
