// How much faster and more suddenly a synthesised motion moves where motions were joined than the motions themselves.
//
// Of a clip, for each frame, the largest speed and the largest acceleration of any joint (first and second differences
// of world positions), and the acceleration of the travel root. Their 99th percentile over the frames of the sources is what these motions do anyway; the ratio
// of a seam is the largest value from 0.25 s before it to 0.25 s after it over that percentile. 1: the seam cannot be
// told from the motions by speed or acceleration.
#pragma once

#include <span>
#include <vector>

#include "kinespace/motion/clip.h"

namespace kinespace {

// The largest speed (cm/s) and acceleration (cm/s^2) of any joint, frame by frame.
struct JointRates {
  double rate_hz = 0;
  std::vector<double> speed;         // from frame i to i + 1: one fewer than frames
  std::vector<double> acceleration;  // around frame i + 1: two fewer than frames
  std::vector<double> root_acceleration;
};
[[nodiscard]] JointRates joint_rates(const Clip& clip);

// The 99th percentiles over all frames of the sources.
struct UsualRates {
  double speed = 0;
  double acceleration = 0;
  double root_acceleration = 0;
};
[[nodiscard]] UsualRates usual_rates(std::span<const JointRates* const> sources);

struct SeamRatios {
  double speed = 0;
  double acceleration = 0;
  double root_acceleration = 0;
  // Of the joints.
  [[nodiscard]] double worst() const { return speed > acceleration ? speed : acceleration; }
};
// Of the stretch [begin_s, end_s] of a clip; times from the clip's first frame.
[[nodiscard]] SeamRatios seam_ratios(const JointRates& clip, double begin_s, double end_s, const UsualRates& usual);

}  // namespace kinespace
