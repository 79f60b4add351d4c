#include "examples/posture.h"

#include <cmath>

namespace kinespace::samples {

Liveliness::Liveliness(Random& random, double variation)
    : lean_(random, 1.5 * degree * variation),
      turn_(random, 1.5 * degree * variation),
      gaze_(random, 7 * degree * variation),
      nod_(random, 3 * degree * variation),
      tilt_(random, 2 * degree * variation),
      left_arm_(random, 3 * degree * variation),
      right_arm_(random, 3 * degree * variation),
      elbows_(random, 4 * degree * variation),
      swing_(1 + random.between(-0.12, 0.12) * variation) {}

BodyPose Liveliness::operator()(double t, BodyPose pose) const {
  pose.spine.pitch += lean_(t);
  pose.spine.yaw += turn_(t);
  pose.head.yaw += gaze_(t) - turn_(t);
  pose.head.pitch += nod_(t) - lean_(t);
  pose.head.roll += tilt_(t);
  pose.arms[0].flexion = swing_ * pose.arms[0].flexion + left_arm_(t);
  pose.arms[1].flexion = swing_ * pose.arms[1].flexion + right_arm_(t);
  for (ArmAngles& arm : pose.arms) arm.elbow += elbows_(t);
  return pose;
}

Stance::Stance(Random& random, double sway)
    : side_(random, 1.6 * sway),
      depth_(random, 0.8 * sway),
      yaw_(random, 3 * degree * sway),
      roll_(random, 1.2 * degree * sway),
      breath_phase_(random.between(0, 2 * pi)) {}

BodyPose Stance::operator()(double t, const Eigen::Vector2d& middle, double heading) const {
  const double breath = std::sin(2 * pi * 0.25 * t + breath_phase_);
  const Eigen::Vector2d place = middle + leftwards(heading) * side_(t) + forwards(heading) * depth_(t);
  BodyPose out;
  out.hips = {place.x(), 0, place.y()};
  out.heading = heading;
  out.pelvis = {.yaw = yaw_(t), .pitch = 0, .roll = roll_(t)};
  out.spine = {.yaw = -0.6 * yaw_(t), .pitch = 1.5 * degree + 0.6 * degree * breath, .roll = -roll_(t)};
  out.head = {.yaw = -0.4 * yaw_(t), .pitch = -0.6 * degree * breath, .roll = 0};
  for (ArmAngles& arm : out.arms) {
    arm = {.flexion = 2 * degree,
           .abduction = 9 * degree,
           .twist = 0,
           .elbow = 14 * degree,
           .lift = 0.8 * degree * breath,
           .wrist = 4 * degree};
  }
  return out;
}

}  // namespace kinespace::samples
