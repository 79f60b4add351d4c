#include "kinespace/footskate/two_bone_ik.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace kinespace {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// At right angles to the thigh: that of the bend where no hint is given or the knee is clearly bent to the hint's side, that of the hint
// where it is straight or bent to the other side, and smoothly between.
Vector3d bending_axis(const TwoBoneLimb& limb, const Vector3d& thigh, const Vector3d& hint) {
  constexpr double clear = 0.5;  // the sine of 30 degrees
  const Vector3d bend = knee_bend(limb);
  const double side = std::clamp(bend.dot(hint) / clear, 0.0, 1.0);
  const double share = hint.isZero() ? 1.0 : side * side * (3 - 2 * side);
  const Vector3d axis = share > 0 ? Vector3d(share * bend.normalized() + (1 - share) * hint) : hint;
  const Vector3d across = axis - thigh * thigh.dot(axis);
  return across.norm() > 1e-12 ? across.normalized() : thigh.unitOrthogonal();
}

}  // namespace

double soft_reach(double wish, double now, double length, double soft_from) {
  const double longest = std::max(now, length * (1 - 1e-6));
  const double soft = std::clamp(now, soft_from * length, longest);
  if (wish <= soft) return wish;
  const double room = longest - soft;
  return room > 0 ? soft + room * (1 - std::exp(-(wish - soft) / room)) : soft;
}

Vector3d knee_bend(const TwoBoneLimb& limb) {
  return (limb.knee - limb.hip).normalized().cross((limb.ankle - limb.knee).normalized());
}

double KneeHinge::reach(double at_bend) const {
  return std::sqrt(std::max(0.0, thigh * thigh + shin * shin + 2 * thigh * shin * share * std::cos(at_bend)));
}

double KneeHinge::bend_for(double reach) const {
  const double cosine = (reach * reach - thigh * thigh - shin * shin) / (2 * thigh * shin);
  return std::acos(std::clamp(cosine / share, -1.0, 1.0));
}

KneeHinge knee_hinge(const TwoBoneLimb& limb, const Vector3d& knee_axis) {
  KneeHinge out{.thigh = (limb.knee - limb.hip).norm(), .shin = (limb.ankle - limb.knee).norm()};
  assert(out.thigh > 0 && out.shin > 0);
  const Vector3d thigh = (limb.knee - limb.hip) / out.thigh;
  const Vector3d shin = (limb.ankle - limb.knee) / out.shin;
  out.axis = bending_axis(limb, thigh, knee_axis);
  const double along = thigh.dot(shin);
  const double across = thigh.dot(out.axis.cross(shin));
  out.share = std::hypot(along, across);
  out.bend = -std::atan2(across, along);
  return out;
}

TwoBoneTurn bend_towards(const TwoBoneLimb& limb, const KneeHinge& hinge, double bend, const Vector3d& target) {
  const Vector3d thigh = (limb.knee - limb.hip) / hinge.thigh;
  const Vector3d shin = (limb.ankle - limb.knee) / hinge.shin;
  const Quaterniond bent(AngleAxisd(bend - hinge.bend, hinge.axis));
  const Vector3d ankle = limb.knee + hinge.shin * (bent * shin) - limb.hip;
  TwoBoneTurn out;
  out.thigh = Quaterniond::FromTwoVectors(ankle, target - limb.hip);
  out.shin = out.thigh * bent;
  out.knee = limb.hip + hinge.thigh * (out.thigh * thigh);
  out.ankle = out.knee + hinge.shin * (out.shin * shin);
  return out;
}

TwoBoneTurn reach_for(const TwoBoneLimb& limb, const Vector3d& target, const TwoBoneOptions& options) {
  const KneeHinge hinge = knee_hinge(limb, options.knee_axis);
  const double length = hinge.thigh + hinge.shin;
  const double wish = std::max((target - limb.hip).norm(), std::abs(hinge.thigh - hinge.shin) + 1e-6 * length);
  const double reach = soft_reach(wish, limb.reach(), length, options.soft_from);
  return bend_towards(limb, hinge, hinge.bend_for(reach), target);
}

}  // namespace kinespace
