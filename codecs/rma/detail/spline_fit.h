// Curves through control points (lin2011, section 5.1).
//
// A Catmull-Rom spline passes through all its control points; the tangent at one is the slope from the point before it
// to the point after (at an end: to the one neighbour), so control points need not stand evenly. Between two control
// points it is the cubic of Hermite.
//
// Control points stand in a fixed span first; then, as long as the curve is off by more than the tolerance anywhere,
// the frame where it is off most becomes one more.
#pragma once

#include <span>
#include <vector>

namespace kinespace {

// The frames of the control points that every curve of so many frames begins with: both ends, and between them evenly,
// at most `span` frames apart. One frame: one.
[[nodiscard]] std::vector<int> regular_knots(int frames, int span);

// The spline at all frames from the first knot to the last: out[f - knots[0]]. Knots ascend; values [knot]. One knot:
// its value. Sums and products in a fixed order: the same bits on every machine.
void evaluate_spline(std::span<const int> knots, std::span<const double> values, std::span<double> out);

// The frames of the control points of `curve`: `start` (ascending, both ends among them) and what must be added.
// tolerance: of the largest difference, in units of the curve, >= 0.
[[nodiscard]] std::vector<int> fit_knots(std::span<const double> curve, std::span<const int> start, double tolerance);

}  // namespace kinespace
