#include "kinespace/synthesis/detail/joined_pair.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kinespace {
namespace {

constexpr int clock_points = 257;

double plain_speed(const Connection& connection, double x) {
  return std::pow(connection.speed(), smooth_step(x) - 1);
}

double plain_mean(const Connection& connection) {
  double sum = 0;
  for (int i = 0; i < clock_points - 1; ++i) sum += plain_speed(connection, (i + 0.5) / (clock_points - 1));
  return sum / (clock_points - 1);
}

// `pose` becomes the blend of itself (weight 1 - w) and of `other`.
void blend_pose(Eigen::RowVectorXd& pose, const Eigen::RowVectorXd& other, const Eigen::RowVectorXd& signs, double w) {
  pose.head<travel_curves>() = (1 - w) * pose.head<travel_curves>() + w * other.head<travel_curves>();
  for (Eigen::Index c = travel_curves; c + 3 < pose.size(); c += 4) {
    const Eigen::Vector4d a = pose.segment<4>(c).transpose();
    const Eigen::Vector4d b = other.segment<4>(c).transpose() * signs((c - travel_curves) / 4);
    const double angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
    const double sine = std::sin(angle);
    Eigen::Vector4d q = sine < 1e-6 ? Eigen::Vector4d((1 - w) * a + w * b)
                                    : Eigen::Vector4d((std::sin((1 - w) * angle) * a + std::sin(w * angle) * b) / sine);
    pose.segment<4>(c) = q.normalized().transpose();
  }
}

Eigen::Quaterniond joint_rotation(const Eigen::RowVectorXd& pose, Eigen::Index joint) {
  const auto q = pose.segment<4>(travel_curves + 4 * joint);
  return Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized();
}

Eigen::Vector3d rotation_vector(Eigen::Quaterniond q) {
  if (q.w() < 0) q.coeffs() *= -1;
  const double sine = q.vec().norm();
  return sine < 1e-12 ? Eigen::Vector3d(2 * q.vec()) : Eigen::Vector3d(2 * std::atan2(sine, q.w()) / sine * q.vec());
}

Eigen::Quaterniond rotation_of(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle)) : Eigen::Quaterniond::Identity();
}

}  // namespace

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

OverlapClock::OverlapClock(const Connection& connection, double duration_s)
    : connection_(connection), duration_s_(duration_s), second_s_(clock_points) {
  const double length = connection.entered_s - connection.enter_s;
  const double slow = 2 * (length / duration_s - plain_mean(connection));  // the bump's mean is 1/2
  const double step = duration_s / (clock_points - 1);
  const auto speed = [&](double x) {
    const double bump = std::sin(std::numbers::pi * x);
    return plain_speed(connection, x) + slow * bump * bump;
  };
  double time = connection.enter_s;
  for (int i = 0; i < clock_points; ++i) {
    second_s_[static_cast<std::size_t>(i)] = time;
    const double x = static_cast<double>(i) / (clock_points - 1);
    const double half = 0.5 / (clock_points - 1);
    time += step * (speed(x) + 4 * speed(x + half) + speed(x + 2 * half)) / 6;
  }
}

double OverlapClock::plain_duration(const Connection& connection) {
  return (connection.entered_s - connection.enter_s) / plain_mean(connection);
}

double OverlapClock::second_s(double overlap_s) const {
  const double at = std::clamp(overlap_s / duration_s_, 0.0, 1.0) * (clock_points - 1);
  const auto i = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(clock_points - 2));
  const double b = at - static_cast<double>(i);
  return (1 - b) * second_s_[i] + b * second_s_[i + 1];
}

JoinedPair::JoinedPair(const CurveSampler& first, const CurveSampler& second, const Join& join)
    : first_(first), second_(second), join_(join), clock_(join.connection, join.duration_s), other_(second.curves()) {
  constexpr int looks = 9;
  signs_.setZero((first.curves() - travel_curves) / 4);
  Eigen::RowVectorXd pose(first.curves());
  for (int i = 0; i < looks; ++i) {
    const double overlap_s = join.duration_s * i / (looks - 1);
    first_.at(clock_.first_s(overlap_s), pose);
    second_at(clock_.second_s(overlap_s), other_);
    for (Eigen::Index k = 0; k < signs_.size(); ++k) {
      signs_(k) += pose.segment<4>(travel_curves + 4 * k).dot(other_.segment<4>(travel_curves + 4 * k));
    }
  }
  for (double& sign : signs_) sign = sign < 0 ? -1 : 1;
  if (join.way == JoinWay::inertialization) offset_ = Offset(*this, 1 / first.rate_hz());
}

JoinedPair::Shares JoinedPair::at(double overlap_s, Eigen::RowVectorXd& pose) {
  const Connection& connection = join_.connection;
  if (overlap_s >= join_.duration_s) {
    const double second_s = connection.entered_s + overlap_s - join_.duration_s;
    second_at(second_s, pose);
    return {1, connection.left_s, second_s};
  }
  if (overlap_s <= 0) {
    const double first_s = connection.leave_s + overlap_s;
    first_.at(first_s, pose);
    return {0, first_s, connection.enter_s};
  }
  if (join_.way == JoinWay::inertialization) {
    const double second_s = connection.enter_s + overlap_s;
    second_at(second_s, pose);
    offset_.add(overlap_s, join_.duration_s, pose);
    return {1, connection.leave_s, second_s};
  }
  const Shares shares{smooth_step(overlap_s / join_.duration_s), clock_.first_s(overlap_s), clock_.second_s(overlap_s)};
  first_.at(shares.first_s, pose);
  second_at(shares.second_s, other_);
  blend_pose(pose, other_, signs_, shares.second);
  return shares;
}

void JoinedPair::second_at(double time_s, Eigen::RowVectorXd& pose) const {
  second_.at(time_s, pose);
  join_.placement.apply(pose);
}

// The speed of the offset by a difference over one frame: what both motions did last.
JoinedPair::Offset::Offset(const JoinedPair& pair, double step_s) {
  const Connection& connection = pair.join_.connection;
  const Eigen::Index joints = (pair.first_.curves() - travel_curves) / 4;
  Eigen::RowVectorXd first(pair.first_.curves()), second(pair.first_.curves());
  const auto offsets_at = [&](double back_s) {
    pair.first_at(connection.leave_s - back_s, first);
    pair.second_at(connection.enter_s - back_s, second);
    Eigen::Matrix3Xd out(3, joints + 1);
    out.col(0) = (first - second).head<travel_curves>().transpose();
    for (Eigen::Index j = 0; j < joints; ++j) {
      out.col(j + 1) = rotation_vector(joint_rotation(first, j) * joint_rotation(second, j).conjugate());
    }
    return out;
  };
  values_ = offsets_at(0);
  // The second motion may begin at its seam: then the first motion's own way goes on.
  const double back = std::min({step_s, connection.leave_s, connection.enter_s});
  speeds_ = back > 0.5 * step_s ? Eigen::Matrix3Xd((values_ - offsets_at(back)) / back)
                                : Eigen::Matrix3Xd::Zero(3, joints + 1).eval();
}

// Each offset runs out by the quintic that has its value and speed at the seam, no acceleration of its own there, and
// ends flat to second order; one that runs towards zero ends early enough not to pass it by.
void JoinedPair::Offset::add(double since_s, double duration_s, Eigen::RowVectorXd& pose) const {
  const auto left_of = [&](Eigen::Index column) -> Eigen::Vector3d {
    const Eigen::Vector3d value = values_.col(column), speed = speeds_.col(column);
    const double along = value.dot(speed);
    double length = duration_s;
    if (along < 0) length = std::min(length, std::max(0.2 * duration_s, -5 * value.squaredNorm() / along));
    const double x = since_s / length;
    if (x >= 1) return Eigen::Vector3d::Zero();
    const double rest = 1 - x;
    const double of_value = rest * rest * rest * (1 + x * (3 + 6 * x));
    const double of_speed = length * x * rest * rest * rest * (1 + 3 * x);
    return of_value * value + of_speed * speed;
  };
  pose.head<travel_curves>() += left_of(0).transpose();
  for (Eigen::Index j = 0; j + 1 < values_.cols(); ++j) {
    const Eigen::Quaterniond q = rotation_of(left_of(j + 1)) * joint_rotation(pose, j);
    pose.segment<4>(travel_curves + 4 * j) << q.w(), q.x(), q.y(), q.z();
  }
}

}  // namespace kinespace
