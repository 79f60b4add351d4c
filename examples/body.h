// The body of the sample motions: its measures, and a pose in the terms motions are planned in.
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "examples/footsteps.h"
#include "kinespace/motion/clip.h"

namespace kinespace::samples {

// Joints by their place in sample_skeleton(); of the limbs the left one, the right one lies limb_joints later.
namespace joint {
enum Index : int {
  hips,
  spine,
  spine1,
  spine2,
  neck,
  head,
  shoulder,
  arm,
  fore_arm,
  hand,
  up_leg = 14,
  leg,
  foot,
  toe
};
}  // namespace joint
inline constexpr int limb_joints = 4;
[[nodiscard]] constexpr int of_side(int left_joint, int side) {
  return left_joint + side * limb_joints;
}

// Lengths in cm that planning needs. `side` is 0 for left, 1 for right, everywhere in this folder.
struct Build {
  explicit Build(const Skeleton& skeleton);
  double thigh;
  double shank;
  FootShape foot;
  Eigen::Vector3d left_hip;  // from the hips joint, in its frame
  double standing;           // height of the hips joint at rest
  [[nodiscard]] Eigen::Vector3d hip(int side) const;
  [[nodiscard]] double leg() const { return thigh + shank; }
};

// Radians. Applied as R_y(yaw) R_x(pitch) R_z(roll): yaw to the left, pitch forwards, roll lifts the left.
struct Angles {
  double yaw = 0;
  double pitch = 0;
  double roll = 0;
  [[nodiscard]] Eigen::Quaterniond rotation() const;
};

// Radians, for either side as for the left one. All zero: the arm hangs, elbow straight, palm to the thigh.
struct ArmAngles {
  double flexion = 0;    // forwards and up
  double abduction = 0;  // sideways and up
  double twist = 0;      // of the upper arm; positive turns a forearm bent forwards outwards and up
  double elbow = 0;      // >= 0
  double lift = 0;       // of the shoulder girdle
  double wrist = 0;      // of the hand, in the plane of the elbow
};

struct BodyPose {
  Eigen::Vector3d hips = Eigen::Vector3d::Zero();  // cm, world
  double heading = 0;                              // radians, world; everything below is relative to it
  Angles pelvis;
  Angles spine;  // shared among the three spine joints
  Angles head;   // shared between neck and head
  std::array<ArmAngles, 2> arms;
  std::array<FootPose, 2> feet;  // world
};

// The greatest height of the hips joint at which neither leg reaches further than `reach` of its length. Throws
// Error{usage} when a foot is too far away for any height.
[[nodiscard]] double highest_hips(const Build& build, const BodyPose& pose, double reach);

// Sets all joints of a frame, and the position of the hips.
void set_pose(Clip& clip, int frame, const Build& build, const BodyPose& pose);

}  // namespace kinespace::samples
