// The encoder's side of a qbc curve: where to break, and which numbers to send. Private to this folder.
//
// All choices are for the least of  squared error + rate_weight * bits  under the hard limit on every frame:
//
//   breaks   from short segments on: segments are merged, breaks moved and inserted as long as that lowers the cost of
//            the segments around them, whose control points are refitted together (a tridiagonal system in the ends,
//            as every middle is a linear function of its ends), with an estimate of the bits;
//   numbers  one after the other, each for the least cost when all later ones are still free to make up for it
//            (the elimination of the same tridiagonal system says what that is).
#pragma once

#include <vector>

#include "kinespace/codecs/qbc/detail/curve_code.h"

namespace kinespace {

[[nodiscard]] CurveShape shape_of(const CurveTask& task);

// A kink costs bits, so the fit shuns those that hardly lower the error: smoothness_weight * kink^2 is added to the
// squared error, where the kink is how far a middle is from going on smoothly over lengths of that ratio.
[[nodiscard]] double smoothness_ratio(int length_before, int length_after);
[[nodiscard]] double smoothness_weight(const CurveTask& task, int length_before, int length_after);

// Ascending, with all common breaks.
[[nodiscard]] std::vector<int> choose_breaks(const CurveTask& task);
// The same from breaks that are near; they stand on the task's grid.
[[nodiscard]] std::vector<int> choose_breaks(const CurveTask& task, const std::vector<int>& start);
// The paper's: break-and-fit (codecs/qbc/quadratic_bezier.h).
[[nodiscard]] std::vector<int> break_and_fit(const CurveTask& task);

[[nodiscard]] CurveNumbers choose_numbers(const CurveTask& task, const std::vector<int>& breaks);

// How far the decoded curve is off.
struct CurveError {
  double largest = 0;  // squared distance of the worst frame
  double sum = 0;      // of all frames
  int worst = 0;       // frame
};
[[nodiscard]] CurveError curve_error(const CurveTask& task, const CodedCurve& curve);

// The control points at every frame, [dimension][count].
void evaluate(const CodedCurve& curve, int dimensions, int first, int count, std::vector<double>& out);

struct CurveChoice {
  CurveTask task;  // with the grid and the step that were taken
  CurveNumbers numbers;
  Bytes code;
  CurveError error;
};
// Finer steps and more breaks until every frame keeps to the limit; then other grids and steps where those cost less.
[[nodiscard]] CurveChoice choose_curve(const CurveTask& task, bool paper);

}  // namespace kinespace
