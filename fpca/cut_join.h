// How two decoded sequences are joined at their common frame (JoinOptions in fpca/encoding.h).
//
// The left sequence gets `value` times Fade::value and minus `slope_before` times Fade::slope, the right one minus the
// first and minus `slope_after` times the second; both fade within `blend` of a sequence. Shared by decoding whole clips
// and by playback.
#pragma once

#include "kinespace/motion/uniform_spline.h"

namespace kinespace {

// The correction's shape over the distance x (in fractions of the sequence) from the cut: `value` is 1 at the cut with
// no slope, `slope` is 0 there and rises at once; both vanish smoothly at x = blend.
struct Fade {
  double value = 0;
  double slope = 0;
};
[[nodiscard]] Fade fade(double x, double blend);

// What Fade::slope is multiplied by in a sequence of so many intervals, so that a slope of 1 per frame at the cut means
// 1 at the first frame beside it.
[[nodiscard]] double fade_steepness(double intervals, double blend);

// What both neighbours of a cut must give up, in values and in slopes (per frame).
struct CutCorrection {
  Eigen::RowVectorXd value;  // to add on the left; the right adds the negative
  Eigen::RowVectorXd slope_before;
  Eigen::RowVectorXd slope_after;
};

// `left`, `right`: [frame][curve] of two sequences, the last frame of one being the first of the other. The part of the
// change of slope at the cut beyond `free_change` times what is typical inside both (rms) is taken out.
[[nodiscard]] CutCorrection cut_correction(const SampleMatrix& left, const SampleMatrix& right, double free_change);

}  // namespace kinespace
