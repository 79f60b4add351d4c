#include "kinespace/synthesis/curve_sampler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace kinespace {
namespace {

Eigen::Quaterniond about_vertical(double angle) {
  return {std::cos(angle / 2), 0, std::sin(angle / 2), 0};
}

Eigen::Quaterniond quaternion_at(const Eigen::RowVectorXd& row, Eigen::Index first) {
  return {row(first), row(first + 1), row(first + 2), row(first + 3)};
}

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

CurveSampler::CurveSampler(const ClipCurves& curves)
    : spline_(curves.values), rate_hz_(curves.rate_hz), start_height_m_(curves.placement.start_cm.y() / 100) {}

void CurveSampler::at(double time_s, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const {
  spline_.value(time_s * rate_hz_, out);
  for (Eigen::Index c = travel_curves; c + 3 < out.size(); c += 4) {
    auto q = out.segment<4>(c);
    const double norm = q.norm();
    if (norm > 0) {
      q /= norm;
    } else {
      q << 1, 0, 0, 0;
    }
  }
}

Eigen::Vector3d CurveSampler::velocity(double time_s) const {
  Eigen::RowVectorXd out(travel_curves);
  spline_.derivative(std::clamp(time_s, 0.0, duration_s()) * rate_hz_, out);
  return out.transpose() * rate_hz_;
}

double CurveSampler::height_m(double time_s) const {
  Eigen::RowVectorXd row(spline_.curves());
  spline_.value(time_s * rate_hz_, row);
  return start_height_m_ + row(1);
}

void invariant_pose(const CurveSampler& sampler, double time_s,
                    Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) {
  Eigen::RowVectorXd row(sampler.curves());
  const double step = std::min(0.5 / sampler.rate_hz(), sampler.duration_s() / 2);
  const double before = std::max(time_s - step, 0.0);
  const double after = std::min(time_s + step, sampler.duration_s());
  sampler.at(before, row);
  const double heading_before = heading_of(quaternion_at(row, travel_curves));
  sampler.at(after, row);
  const double heading_after = heading_of(quaternion_at(row, travel_curves));
  sampler.at(time_s, row);
  const Eigen::Quaterniond root = quaternion_at(row, travel_curves);
  const Eigen::Quaterniond upright = about_vertical(heading_of(root)).conjugate();

  out.head<3>() = (upright * sampler.velocity(time_s)).transpose();
  out(3) = after > before ? wrapped(heading_after - heading_before) / (after - before) : 0;
  out(InvariantPose::height) = sampler.height_m(time_s);
  Eigen::Quaterniond swing = upright * root;
  if (swing.w() < 0) swing.coeffs() *= -1;  // without a twist w is positive: the sign that goes on from frame to frame
  out.segment<4>(InvariantPose::rotations) << swing.w(), swing.x(), swing.y(), swing.z();
  out.tail(row.size() - travel_curves - 4) = row.tail(row.size() - travel_curves - 4);
}

void GroundMotion::apply(Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> curves) const {
  const Eigen::Quaterniond turn = about_vertical(turn_rad);
  const Eigen::Vector3d moved = turn * Eigen::Vector3d(curves(0), curves(1), curves(2)) + Eigen::Vector3d(x_m, 0, z_m);
  curves.head<3>() = moved.transpose();
  const Eigen::Quaterniond root = turn * Eigen::Quaterniond(curves(3), curves(4), curves(5), curves(6));
  curves.segment<4>(travel_curves) << root.w(), root.x(), root.y(), root.z();
}

}  // namespace kinespace
