#include "kinespace/footskate/two_bone_ik.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace kinespace {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// At right angles to the thigh, nearly that of the bend, and that of the hint where there is hardly a bend.
Vector3d bending_axis(const TwoBoneLimb& limb, const Vector3d& thigh, const Vector3d& hint) {
  constexpr double straight = 0.05;  // sine of about 3 degrees
  const Vector3d bend = knee_bend(limb);
  const double share = std::max(0.0, 1 - bend.norm() / straight);
  const Vector3d axis = bend + straight * share * share * hint;
  const Vector3d across = axis - thigh * thigh.dot(axis);
  return across.norm() > 1e-12 ? across.normalized() : thigh.unitOrthogonal();
}

// The turn of the shin about `axis` after which cos(bend) = thigh . shin is as wished; 0 when it is so already.
double knee_turn(const Vector3d& thigh, const Vector3d& shin, const Vector3d& axis, double wished_cosine) {
  const double along = thigh.dot(shin);
  const double across = thigh.dot(axis.cross(shin));
  const double size = std::hypot(along, across);
  return std::atan2(across, along) + std::acos(std::clamp(wished_cosine / size, -1.0, 1.0));
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

TwoBoneTurn reach_for(const TwoBoneLimb& limb, const Vector3d& target, const TwoBoneOptions& options) {
  const double a = (limb.knee - limb.hip).norm();
  const double b = (limb.ankle - limb.knee).norm();
  assert(a > 0 && b > 0);
  const Vector3d thigh = (limb.knee - limb.hip) / a;
  const Vector3d shin = (limb.ankle - limb.knee) / b;
  const double wish = std::max((target - limb.hip).norm(), std::abs(a - b) + 1e-6 * (a + b));
  const double reach = soft_reach(wish, limb.reach(), a + b, options.soft_from);
  const Vector3d axis = bending_axis(limb, thigh, options.knee_axis);
  const Quaterniond bent(AngleAxisd(knee_turn(thigh, shin, axis, (reach * reach - a * a - b * b) / (2 * a * b)), axis));
  const Vector3d ankle = limb.knee + b * (bent * shin) - limb.hip;
  TwoBoneTurn out;
  out.thigh = Quaterniond::FromTwoVectors(ankle, target - limb.hip);
  out.shin = out.thigh * bent;
  out.knee = limb.hip + a * (out.thigh * thigh);
  out.ankle = out.knee + b * (out.shin * shin);
  return out;
}

}  // namespace kinespace
