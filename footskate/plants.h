// Where planted feet shall stand: one place for every contact, and for the foot as a whole the displacement that takes
// it there, over all frames.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "kinespace/footskate/contacts.h"

namespace kinespace {

struct Plant {
  FootContact contact;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // cm, world: where the joint stands in all of these frames
};

// One place a contact. Contacts of one foot that overlap are one stance: the joint that stands longest gets the mean of
// its places across the ground (but for a tenth at both ends, where it may be coming or leaving) and the median of its
// heights; the other joint stands at the foot's length from it, in the mean direction of the frames in which both
// stand. Then the stance is set on the ground by its toe (of a foot without: by its ankle), if that is within 8 % of
// the leg length of it, and the ground is not uneven.
[[nodiscard]] std::vector<Plant> place_plants(const FootTracks& tracks, const Ground& ground,
                                              const FootContacts& contacts);

// What one foot must do in its planted frames.
struct FootTask {
  std::vector<char> planted;                  // ankle or toe
  std::vector<char> flat;                     // both: the turn of the foot is given
  std::vector<Eigen::Vector3d> turn;          // rotation vector, world
  std::vector<Eigen::Vector3d> displacement;  // cm, world, of the ankle; zero where not planted
  std::vector<double> lift;                   // cm, of the ankle, on top of all else; empty: none
};

// The level that a foot may not go below: the ground; on uneven ground the lower of its plants before and after, or,
// where the captured foot goes below that by more than 8 % of the leg length, the lowest that it goes.
class FloorUnder {
 public:
  FloorUnder(const FootTracks& tracks, const Ground& ground, const std::vector<Plant>& plants, int leg);
  [[nodiscard]] double at(const Eigen::Vector3d& point, int frame) const {
    return level_.empty() ? ground_.at(point) : level_[frame];
  }

 private:
  void lower_to_foot(const FootTracks& tracks, int leg, const std::vector<double>& stand);

  Ground ground_;
  std::vector<double> level_;  // uneven only
};

// Where one joint stands and the other would be under the floor, the foot turns until it is on it. Between plants a
// turn is carried over as join_between does.
[[nodiscard]] FootTask foot_task(const FootTracks& tracks, int leg, const std::vector<Plant>& plants,
                                 const FloorUnder& floor);

// Values given at the frames that `known` marks, joined between: it leaves and meets them with their own speed, has no
// acceleration there, and before the first and after the last eases to zero within half a second. Twice continuously
// differentiable but for what the given values' own noise is.
void join_between(const std::vector<char>& known, double rate_hz, std::vector<Eigen::Vector3d>& values);

}  // namespace kinespace
