// The curves of a clip at any time, and what of them does not depend on where the clip stood and looked.
//
// Between frames the curves are cubic splines (motion/uniform_spline.h); at a frame they are the frame. Times are seconds
// from the first frame, clamped to the clip.
#pragma once

#include <Eigen/Core>

#include "kinespace/motion/curves.h"
#include "kinespace/motion/uniform_spline.h"

namespace kinespace {

inline constexpr int travel_curves = 3;  // the root's position comes before the quaternions

class CurveSampler {
 public:
  explicit CurveSampler(const ClipCurves& curves);

  [[nodiscard]] double duration_s() const { return static_cast<double>(spline_.samples() - 1) / rate_hz_; }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] Eigen::Index curves() const { return spline_.curves(); }

  // All curves: the root's position in metres in the clip's frame, then unit quaternions.
  void at(double time_s, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const;
  // The root's velocity, m/s, in the clip's frame.
  [[nodiscard]] Eigen::Vector3d velocity(double time_s) const;
  // The root's height over the world's origin in metres.
  [[nodiscard]] double height_m(double time_s) const;

 private:
  UniformSpline spline_;
  double rate_hz_;
  double start_height_m_;
};

// What is left of a pose and its change when the ground plane has no places and no directions:
//   0..2  the root's velocity, m/s, in the frame of its heading
//   3     the rate of its heading, rad/s
//   4     the root's height, m
//   5..8  the root's orientation without its heading (w x y z)
//   9..   the other joints' quaternions
// Two motions that differ by a rigid motion in the ground plane have the same.
struct InvariantPose {
  static constexpr int rates = 4;  // the first four change with the speed of play
  static constexpr int height = 4;
  static constexpr int rotations = 5;
  // From the number of curves of a clip.
  [[nodiscard]] static Eigen::Index size(Eigen::Index curves) { return curves + 2; }
};
void invariant_pose(const CurveSampler& sampler, double time_s,
                    Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out);

// A rigid motion in the ground plane: first turned about the vertical through the origin, then moved.
struct GroundMotion {
  double turn_rad = 0;
  double x_m = 0;
  double z_m = 0;
  // Of curves' rows: the root's position and orientation.
  void apply(Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> curves) const;
};

}  // namespace kinespace
