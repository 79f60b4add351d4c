// Puts the feet of a played level of detail back where those of the original stood.
//
// A level of a few functions has feet that float by centimetres. What a clip keeps (footskate/kept_feet.h) says where
// each joint of a foot stood and when. In a contact the joint is taken there; a contact's last displacement fades
// after it, and that of the next comes before it, within `fade_s`, twice continuously differentiable, so that nothing
// pops. With W how much a joint is held and E the displacement that it is held with (0 where it is not held),
//
//   ankle's displacement  d   = E_ankle + (1 - W_ankle) E_toe
//   toe's                 d_t = E_toe + (1 - W_toe) E_ankle
//
// the foot keeps its length (of both joints the one that is held less gives way, of equals the ankle), two-bone inverse
// kinematics (footskate/two_bone_ik.h) brings the ankle to its place, and the foot, which keeps its orientation in the
// world, then turns by the least that points it at the toe's. A foot that would be more than 0.3 cm below the
// original's floor is lifted. One moment and the contacts beside it are all that is looked at.
//
// What it does not do: move the root. A leg that does not reach stays short of the place.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/footskate/kept_feet.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {

// A leg at one moment, world. Rotations are joint to world.
struct LegState {
  JointFrame hip, knee, ankle;
  Eigen::Vector3d toe = Eigen::Vector3d::Zero();  // the ankle's place for a foot without one
  // Of the parents of hip, knee and ankle.
  Eigen::Quaterniond above_hip = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond above_knee = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond above_ankle = Eigen::Quaterniond::Identity();
};

// Local rotations for the joints of a leg.
struct LegRotations {
  Eigen::Quaterniond hip, knee, ankle;
};

// Of so many functions and more the feet are near enough to where they stood: planting is of use below.
inline constexpr int planted_below = 10;

class FootPlanter {
 public:
  static constexpr double fade_s = 0.2;

  // How far each contact's joint is from its place at the contact's first and last frame, cm, world: two a contact, in
  // their order. It depends on the level of detail that is played.
  using Ends = std::vector<Eigen::Vector3f>;

  FootPlanter(const KeptFeet& feet, const Placement& placement, double rate_hz);

  [[nodiscard]] const KeptFeet& feet() const { return feet_; }
  [[nodiscard]] int contact_count() const { return static_cast<int>(feet_.contacts.size()); }
  [[nodiscard]] const KeptContact& contact(int i) const { return feet_.contacts[static_cast<std::size_t>(i)]; }
  // Where the joint of a contact stood at a frame of it, cm, world.
  [[nodiscard]] Eigen::Vector3d place(int contact, double frame) const;

  // What the joints of a leg (0 left, 1 right) turn to; nullopt where it stays as it is. `frame` may lie between two
  // frames; `ends` is that of the level that is played.
  [[nodiscard]] std::optional<LegRotations> plant(int leg, double frame, const LegState& state,
                                                  std::span<const Eigen::Vector3f> ends) const;

 private:
  struct Hold {
    double weight = 0;
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] Hold hold(int slot, double frame, const Eigen::Vector3d& at,
                          std::span<const Eigen::Vector3f> ends) const;
  // Where ankle and toe shall be.
  struct Goals {
    Eigen::Vector3d ankle, toe;
  };
  [[nodiscard]] Goals goals(int leg, double frame, const LegState& state, std::span<const Eigen::Vector3f> ends) const;
  // How far a place must go up to be on the floor, cm.
  [[nodiscard]] double lift(const Eigen::Vector3d& at) const;

  KeptFeet feet_;  // places in the world
  double fade_frames_;
  std::array<int, 5> first_of_slot_{};  // into contacts
};

// Plants the feet of a decoded clip on the bones that it was read with. `placement` is that of the clip's curves.
void plant_feet(Clip& clip, const KeptFeet& feet, const Placement& placement);

// How the feet of a decoded clip stand, by the contacts and the floor of the original.
struct FeetMeasures {
  double slide_cm_s = 0;            // foot_slide_cm_s (footskate/skate_measures.h)
  double floor_penetration_cm = 0;  // of the deepest joint of a foot under the lowest that the original's came
};
[[nodiscard]] FeetMeasures measure_feet(const Clip& clip, const KeptFeet& feet, const Placement& placement);

}  // namespace kinespace
