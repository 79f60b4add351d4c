#include "bench/middle_seconds.h"

#include <algorithm>
#include <cmath>

namespace kinespace {

Eigen::Index add_middle_second(const ClipCurves& clip, CurveMatrix& out, Eigen::Index row) {
  if (clip.frames() < 2) return row;
  const double last_frame = std::min<double>(clip.frames() - 1, std::round(clip.rate_hz));
  const double first_frame = std::floor((clip.frames() - 1 - last_frame) / 2);
  for (Eigen::Index curve = 3; curve < clip.values.cols() && row < out.rows(); ++curve, ++row) {
    for (int t = 0; t < middle_second_points; ++t) {
      const double frame = first_frame + last_frame * t / (middle_second_points - 1);
      const auto below = std::min(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(clip.frames() - 2));
      const double share = frame - static_cast<double>(below);
      out(row, t) = (1 - share) * clip.values(below, curve) + share * clip.values(below + 1, curve);
    }
  }
  return row;
}

FpcaOptions smoothed_fpca() {
  return {.mean = MeanEstimate::smooth,
          .smooth_covariance = true,
          .estimate_noise = true,
          .scores = ScoreKind::conditional};
}

}  // namespace kinespace
