// The floor under a clip, from where its feet rest.
//
// A rest is a time of at least 70 ms in which a joint of a foot stays at its height (vertical speed below 0.15 leg
// lengths a second) and is slow against the floor (below 0.18 leg lengths a second plus 0.3 of the root's speed, so
// that feet which skate rest too). The level of the ground is that of the lower joint of the foot: the toe joint where
// there is one, else the ankle; the sole below it is part of the body and not known.
//
//   flat    at least 90 % of the rest lies within 3 % of the leg length of one height (85 % when the others are above
//           it and never alone in bearing the body: a foot held in the air)
//   slope   the same about a plane that rises by at most 0.7, over at least half a leg length, with both feet at three
//           places or more along the rise and the body above it
//   uneven  neither: stairs, steps, boxes, bars. Every plant then stands at its own height; the height stated is that
//           of the lowest level with a tenth of the rest
//
// No rest at all (one frame, a flight): the lowest height a foot reaches, as flat.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "kinespace/footskate/foot_tracks.h"

namespace kinespace {

enum class GroundKind : std::uint8_t { flat, slope, uneven };

// "flat", "slope", "uneven".
[[nodiscard]] std::string_view to_string(GroundKind kind);

struct Ground {
  GroundKind kind = GroundKind::flat;
  double height_cm = 0;                                // flat: everywhere; slope: at x = z = 0
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  // rise along X and along Z; zero unless a slope

  // The level under a point, cm. Of uneven ground the lowest level.
  [[nodiscard]] double at(const Eigen::Vector3d& point) const {
    return height_cm + gradient.x() * point.x() + gradient.y() * point.z();
  }
};

// A time in which a joint of a foot rests; slot as in FootTracks::at. Both ends included.
struct Rest {
  int slot = 0;
  int first_frame = 0;
  int last_frame = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // cm, world: the mean of x and z, the median of y
};

// All rests, by slot, then by time.
[[nodiscard]] std::vector<Rest> find_rests(const FootTracks& tracks);

// Those of them that bear the body on this ground: at its level (ankles at theirs) within 5 % of the leg length; on
// uneven ground at any level, if at some time in the rest the other foot has none, or is never clearly lower. A foot
// held still in the air never bears the body.
[[nodiscard]] std::vector<Rest> bearing_rests(const FootTracks& tracks, const Ground& ground);

// The height of each slot over the ground while its foot stands flat, cm: the median over rests whose toe is on the
// ground; 0 for toes, and for ankles of feet without them.
[[nodiscard]] std::array<double, 4> standing_heights(const FootTracks& tracks, const Ground& ground);

[[nodiscard]] Ground estimate_ground(const FootTracks& tracks);

}  // namespace kinespace
