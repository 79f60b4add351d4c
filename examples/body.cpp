#include "examples/body.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "examples/smooth.h"
#include "kinespace/base/error.h"

namespace kinespace::samples {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond about_x(double a) {
  return Quaterniond(AngleAxisd(a, Vector3d::UnitX()));
}
Quaterniond about_y(double a) {
  return Quaterniond(AngleAxisd(a, Vector3d::UnitY()));
}
Quaterniond about_z(double a) {
  return Quaterniond(AngleAxisd(a, Vector3d::UnitZ()));
}

// The same turn seen in the mirror that swaps left and right.
Quaterniond mirrored(const Quaterniond& q) {
  return {q.w(), q.x(), -q.y(), -q.z()};
}

Quaterniond hips_rotation(const BodyPose& pose) {
  return about_y(pose.heading) * pose.pelvis.rotation();
}

Angles share(const Angles& a, double part) {
  return {a.yaw * part, a.pitch * part, a.roll * part};
}

struct LegRotations {
  Quaterniond thigh;  // world
  Quaterniond shank;
};

// Two bones from hip to ankle, the knee towards `front`. At rest both point along -Y and bend about +X.
LegRotations bend_leg(const Vector3d& hip, const Vector3d& ankle, const Vector3d& front, double thigh, double shank) {
  const Vector3d line = ankle - hip;
  const double length = std::min(line.norm(), thigh + shank);
  const Vector3d down = line.normalized();
  const Vector3d axis = front.cross(down).normalized();
  const Vector3d forward = down.cross(axis);
  const double along = (length * length + thigh * thigh - shank * shank) / (2 * length);
  const double aside = std::sqrt(std::max(0.0, thigh * thigh - along * along));
  const Vector3d knee = hip + along * down + aside * forward;
  const auto frame = [&axis](const Vector3d& up) {
    Eigen::Matrix3d m;
    m << axis, up, axis.cross(up);
    return Quaterniond(m);
  };
  return {frame((hip - knee) / thigh), frame((knee - (hip + length * down)) / shank)};
}

void set_leg(Clip& clip, int frame, const Build& build, const BodyPose& pose, int side) {
  const Quaterniond body = hips_rotation(pose);
  const FootPose& at = pose.feet[static_cast<std::size_t>(side)];
  const double facing = pose.heading + 0.5 * pose.pelvis.yaw + 0.5 * (at.yaw - pose.heading);
  const Vector3d hip_position = pose.hips + body * build.hip(side);
  const auto [thigh, shank] =
      bend_leg(hip_position, at.ankle(build.foot), {std::sin(facing), 0, std::cos(facing)}, build.thigh, build.shank);
  clip.set_rotation(of_side(joint::up_leg, side), frame, body.conjugate() * thigh);
  clip.set_rotation(of_side(joint::leg, side), frame, thigh.conjugate() * shank);
  clip.set_rotation(of_side(joint::foot, side), frame, shank.conjugate() * at.rotation());
  clip.set_rotation(of_side(joint::toe, side), frame, about_x(-at.toe_bend));
}

void set_arm(Clip& clip, int frame, const ArmAngles& a, int side) {
  // At rest the left arm points along +X; hanging, its own x axis points down and its z axis forwards.
  const Quaterniond lift = about_z(a.lift);
  const Quaterniond upper = lift.conjugate() * about_x(-a.flexion) * about_z(a.abduction - pi / 2) * about_x(-a.twist);
  const auto put = [&](int left_joint, const Quaterniond& q) {
    clip.set_rotation(of_side(left_joint, side), frame, side == 0 ? q : mirrored(q));
  };
  put(joint::shoulder, lift);
  put(joint::arm, upper);
  put(joint::fore_arm, about_y(-a.elbow));
  put(joint::hand, about_y(-a.wrist));
}

}  // namespace

Build::Build(const Skeleton& skeleton)
    : thigh(skeleton.joints[joint::leg].offset.norm()),
      shank(skeleton.joints[joint::foot].offset.norm()),
      foot{.ankle_height = -skeleton.joints[joint::toe].offset.y(),
           .ankle_to_toe = skeleton.joints[joint::toe].offset.z(),
           .heel_to_ankle = 0.037 * skeleton.rest_height(),
           .toe_length = skeleton.joints[joint::toe].end_site->z()},
      left_hip(skeleton.joints[joint::up_leg].offset),
      standing(skeleton.joints[joint::hips].offset.y()) {}

Vector3d Build::hip(int side) const {
  return side == 0 ? left_hip : Vector3d(-left_hip.x(), left_hip.y(), left_hip.z());
}

Quaterniond Angles::rotation() const {
  return about_y(yaw) * about_x(pitch) * about_z(roll);
}

double highest_hips(const Build& build, const BodyPose& pose, double reach) {
  const Quaterniond body = hips_rotation(pose);
  double highest = std::numeric_limits<double>::infinity();
  for (int side = 0; side < 2; ++side) {
    const Vector3d hip = body * build.hip(side);
    const Vector3d ankle = pose.feet[static_cast<std::size_t>(side)].ankle(build.foot);
    const double far = std::hypot(pose.hips.x() + hip.x() - ankle.x(), pose.hips.z() + hip.z() - ankle.z());
    const double most = reach * build.leg();
    if (far >= most) {
      throw Error(ErrorKind::usage, {.file = {},
                                     .line = 0,
                                     .found = fmt::format("a foot planned {:.1f} cm from the hip", far),
                                     .expected = fmt::format("less than {:.1f} cm", most),
                                     .remedy = "ask for less speed, a higher cadence or a smaller turn rate"});
    }
    highest = std::min(highest, ankle.y() + std::sqrt(most * most - far * far) - hip.y());
  }
  return highest;
}

void set_pose(Clip& clip, int frame, const Build& build, const BodyPose& pose) {
  clip.require_translation_track(joint::hips).values[static_cast<std::size_t>(frame)] = pose.hips;
  clip.set_rotation(joint::hips, frame, hips_rotation(pose));
  for (const int part : {joint::spine, joint::spine1, joint::spine2}) {
    clip.set_rotation(part, frame, share(pose.spine, 1.0 / 3).rotation());
  }
  for (const int part : {joint::neck, joint::head}) clip.set_rotation(part, frame, share(pose.head, 0.5).rotation());
  for (int side = 0; side < 2; ++side) {
    set_arm(clip, frame, pose.arms[static_cast<std::size_t>(side)], side);
    set_leg(clip, frame, build, pose, side);
  }
}

}  // namespace kinespace::samples
