// How far filled frames are from the truth: the measures of the in-betweening literature (Harvey et al. 2020, "Robust
// motion in-betweening", LaFAN1), beside the mean joint error.
#pragma once

#include <span>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/synthesis/filling_gap.h"

namespace kinespace {

// Standard deviations of joint positions (cm) relative to where the body stood up to 1.5 s before, and how it was
// turned: what L2P divides by. [3 joint + axis]
struct PositionScale {
  Eigen::VectorXd deviation;
};
[[nodiscard]] PositionScale position_scale(std::span<const Clip> library);

class FillingMeasures {
 public:
  explicit FillingMeasures(const PositionScale& scale) : scale_(scale) {}
  // The frames of a gap, filled and true.
  void add(const Clip& truth, const Clip& filled, FrameRange gap);

  // Mean distance of joints in cm, over joints and frames, mean over gaps.
  [[nodiscard]] double joint_error_cm() const { return joint_error_ / gaps_; }
  // L2 distance of all joints' world positions, each coordinate over its standard deviation, mean over frames.
  [[nodiscard]] double l2p() const { return l2p_ / gaps_; }
  // L2 distance of all joints' world quaternions, mean over frames.
  [[nodiscard]] double l2q() const { return l2q_ / gaps_; }
  // Earth mover's distance of normalised power spectra of the world quaternions, weighted by the true power
  // (Gopalakrishnan et al. 2019).
  [[nodiscard]] double npss() const { return spectrum_ / power_; }
  [[nodiscard]] int gaps() const { return static_cast<int>(gaps_); }

 private:
  void add_spectra(const Eigen::MatrixXd& truth, const Eigen::MatrixXd& filled);
  const PositionScale& scale_;
  double gaps_ = 0, joint_error_ = 0, l2p_ = 0, l2q_ = 0, spectrum_ = 0, power_ = 0;
};

}  // namespace kinespace
