// What every body does beside its task: it stands somehow, breathes, and is never quite still.
#pragma once

#include "examples/body.h"
#include "examples/smooth.h"

namespace kinespace::samples {

// Slow small changes of trunk, head and arms, a few degrees times `variation`; feet and hips stay as they are.
class Liveliness {
 public:
  Liveliness(Random& random, double variation);
  [[nodiscard]] BodyPose operator()(double t, BodyPose pose) const;

 private:
  Wobble lean_, turn_, gaze_, nod_, tilt_, left_arm_, right_arm_, elbows_;
  double swing_;  // factor on the arms' flexion
};

// A body that stands at `middle`, shifting its weight; hips.y is zero.
class Stance {
 public:
  // `sway`: share of the usual shifting.
  Stance(Random& random, double sway);
  [[nodiscard]] BodyPose operator()(double t, const Eigen::Vector2d& middle, double heading) const;

 private:
  Wobble side_, depth_, yaw_, roll_;
  double breath_phase_;
};

}  // namespace kinespace::samples
