// Cubic splines through points and near points, on any ascending places.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kinespace {

// What closes the spline at its two ends.
enum class SplineEnds : std::uint8_t {
  natural,     // no curvature at the ends
  four_point,  // the third derivative of the cubic through the four outermost points (Forsythe, Malcolm, Moler; R's
               // spline())
};

// The cubic spline through (x, y) at the places `at` (beyond the ends it goes on as the outermost cubic). x strictly
// ascending. One point gives a constant, two a line, and with three points four_point is the parabola through them.
// Throws Error{usage} when x is not ascending, or the sizes differ or are zero.
[[nodiscard]] std::vector<double> interpolate_spline(std::span<const double> x, std::span<const double> y,
                                                     std::span<const double> at,
                                                     SplineEnds ends = SplineEnds::four_point);

// The curve g that of all curves makes least
//
//   sum_i (y_i - g(x_i))^2  +  penalty integral g''(x)^2 dx
//
// a natural cubic spline with its knots at x (Reinsch 1967; Green and Silverman 1994, section 2.3): with second
// derivatives c at the inner knots, (R + penalty Q'Q) c = Q'y and g = y - penalty Q c, one band of five diagonals.
struct SmoothingSpline {
  std::vector<double> values;  // g(x_i)
  double penalty = 0;
  double mean_square_residual = 0;  // of y_i - g(x_i)
  double roughness = 0;             // integral g''^2
};

// x as above, penalty >= 0: 0 passes through the points, a large one is the straight line of least squares. Fewer than
// three points are passed through. Throws Error{usage} as above and for a penalty that is negative or not finite.
[[nodiscard]] SmoothingSpline smoothing_spline(std::span<const double> x, std::span<const double> y, double penalty);

// The smoothest curve whose mean square residual is the variance of the noise in y (Reinsch's choice of the penalty): no
// noise passes through the points, more than a straight line leaves gives that line. `noise_variance` >= 0.
[[nodiscard]] SmoothingSpline smoothing_spline_for_noise(std::span<const double> x, std::span<const double> y,
                                                         double noise_variance);

}  // namespace kinespace
