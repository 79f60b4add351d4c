// Curves to analyse and to time by: the rotations of the second in the middle of clips.
#pragma once

#include "kinespace/fpca/functional_pca.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

inline constexpr int middle_second_points = 100;

// Rows of `out` (of that many points) from `row` on, as far as they go: the rotation curves of the clip's middle second,
// or of all of a shorter clip; none of a clip of one frame. Returns the next free row.
[[nodiscard]] Eigen::Index add_middle_second(const ClipCurves& clip, CurveMatrix& out, Eigen::Index row);

// Functional PCA as yoo2019 (section 4.1) runs it: smoothed mean and covariance, noise variance, conditional scores.
[[nodiscard]] FpcaOptions smoothed_fpca();

}  // namespace kinespace
