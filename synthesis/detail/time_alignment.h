// Corresponding times of two whole motions, so that they can be blended.
//
// Dynamic time warping of the keyframes (kernels/dtw.h; yoo2019, eq. 12 and 13) with slopes in [1/2, 2] where the
// lengths allow it; its staircase is replaced by a monotone cubic (fritsch 1980) through knots every 0.2 s, with the
// first and the last frames matched.
#pragma once

#include <vector>

#include "kinespace/motion/curves.h"

namespace kinespace {

class TimeMap {
 public:
  // The straight map of [0, from_s] to [0, to_s].
  TimeMap(double from_s, double to_s) : TimeMap(std::vector<double>{0, from_s}, {0, to_s}) {}
  // Through the knots: both ascend strictly.
  TimeMap(std::vector<double> from, std::vector<double> to);

  [[nodiscard]] double operator()(double time_s) const;
  [[nodiscard]] double from_s() const { return from_.back(); }
  [[nodiscard]] double to_s() const { return to_.back(); }

 private:
  std::vector<double> from_, to_, slope_;
};

// From the times of `reference` to those of `other`; both of one joint tree.
[[nodiscard]] TimeMap align_times(const ClipCurves& reference, const ClipCurves& other, const Skeleton& skeleton);

}  // namespace kinespace
