// Inverse kinematics of a limb of two bones (hip - knee - ankle), in closed form.
//
// The knee turns about its own axis (at right angles to the plane of the leg) until the ankle is as far from the hip as
// the target is; then the whole leg turns about the hip by the smallest rotation that brings the ankle there. So the
// plane of the knee goes with the leg and no more, and a target where the ankle is gives no change at all.
//
// A leg near its full length is soft (kovar 2002b): there a small step of the target would turn the knee by much. Up to
// `soft_from` of its length, or up to the reach it has now where that is more, a leg follows exactly; beyond, the reach
// nears the full length as 1 - exp(-x) does, with no step in speed, and the ankle stays short of the target.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace kinespace {

// World positions, cm.
struct TwoBoneLimb {
  Eigen::Vector3d hip = Eigen::Vector3d::Zero();
  Eigen::Vector3d knee = Eigen::Vector3d::Zero();
  Eigen::Vector3d ankle = Eigen::Vector3d::Zero();

  [[nodiscard]] double length() const { return (knee - hip).norm() + (ankle - knee).norm(); }
  [[nodiscard]] double reach() const { return (ankle - hip).norm(); }
};

struct TwoBoneOptions {
  double soft_from = 0.99;  // share of the length, 0.5 to 1
  // The axis of the knee, world, unit length: used where the leg is so straight that its plane cannot be told, and for
  // the side to which a knee bends (captured knees bend a little to the other side). Zero: not known.
  Eigen::Vector3d knee_axis = Eigen::Vector3d::Zero();
};

// Rotations of the world to apply before those the joints have: new world rotation = thigh * old one.
struct TwoBoneTurn {
  Eigen::Quaterniond thigh = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond shin = Eigen::Quaterniond::Identity();
  Eigen::Vector3d knee = Eigen::Vector3d::Zero();   // where they are then, cm
  Eigen::Vector3d ankle = Eigen::Vector3d::Zero();  // the target, or as near as the leg reaches
};

// The axis about which the knee bends: thigh x shin, of length sin(bend).
[[nodiscard]] Eigen::Vector3d knee_bend(const TwoBoneLimb& limb);

// How a leg bends in its plane: reach^2 = thigh^2 + shin^2 + 2 thigh shin share cos(bend).
struct KneeHinge {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // world, unit length, at right angles to the thigh
  double thigh = 0, shin = 0;                       // cm
  double share = 1;                                 // of the shin that lies in the plane; 1 for a hinge
  double bend = 0;                                  // now, radians; 0: straight, < 0: bent to the other side

  [[nodiscard]] double reach(double at_bend) const;
  // The bend >= 0 at which the leg reaches so far, or as near to it as it comes.
  [[nodiscard]] double bend_for(double reach) const;
};
[[nodiscard]] KneeHinge knee_hinge(const TwoBoneLimb& limb, const Eigen::Vector3d& knee_axis);

// The leg with its knee bent so, and turned so that the ankle is in the direction of the target.
[[nodiscard]] TwoBoneTurn bend_towards(const TwoBoneLimb& limb, const KneeHinge& hinge, double bend,
                                       const Eigen::Vector3d& target);

// The reach a leg of `length` takes that now reaches `now`, for a wish: soft as above.
[[nodiscard]] double soft_reach(double wish, double now, double length, double soft_from = 0.99);

// Both bones must have a length.
[[nodiscard]] TwoBoneTurn reach_for(const TwoBoneLimb& limb, const Eigen::Vector3d& target,
                                    const TwoBoneOptions& options = {});

}  // namespace kinespace
