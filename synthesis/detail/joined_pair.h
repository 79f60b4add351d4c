// Two motions, joined: the pose of the result at any time around an overlap, and what of the motions it is made of.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/transition.h"

namespace kinespace {

// 0 to 1 with first and second derivative 0 at both ends.
[[nodiscard]] double smooth_step(double x);

// The second motion's time within an overlap that is blended, by the output's clock: its speed goes from 1 / u to 1,
// times what slows the whole down in the middle.
class OverlapClock {
 public:
  // The overlap lasts exactly `duration_s`.
  OverlapClock(const Connection& connection, double duration_s);

  // How long the overlap lasts when nothing slows it down.
  [[nodiscard]] static double plain_duration(const Connection& connection);

  [[nodiscard]] double second_s(double overlap_s) const;
  [[nodiscard]] double first_s(double overlap_s) const {
    return connection_.leave_s + connection_.speed() * (second_s(overlap_s) - connection_.enter_s);
  }

 private:
  Connection connection_;
  double duration_s_;
  std::vector<double> second_s_;
};

// Poses by the time since the overlap began. Both samplers must outlive it.
class JoinedPair {
 public:
  JoinedPair(const CurveSampler& first, const CurveSampler& second, const Join& join);

  // The second motion's share and both motions' times.
  struct Shares {
    double second = 0;
    double first_s = 0, second_s = 0;
  };
  Shares at(double overlap_s, Eigen::RowVectorXd& pose);
  // One of the two alone: where it is in the joined motion's world.
  void first_at(double time_s, Eigen::RowVectorXd& pose) const { first_.at(time_s, pose); }
  void second_at(double time_s, Eigen::RowVectorXd& pose) const;

 private:
  // What is left of how the first motion differed from the second where it was left.
  class Offset {
   public:
    Offset() = default;
    Offset(const JoinedPair& pair, double step_s);
    void add(double since_s, double duration_s, Eigen::RowVectorXd& pose) const;

   private:
    Eigen::Matrix3Xd values_, speeds_;  // the root's place in metres, then a rotation vector a joint
  };

  const CurveSampler& first_;
  const CurveSampler& second_;
  Join join_;
  OverlapClock clock_;
  Eigen::RowVectorXd other_, signs_;
  Offset offset_;
};

}  // namespace kinespace
