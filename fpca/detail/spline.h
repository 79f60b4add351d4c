// Interpolation by a cubic spline: the one place where ALGLIB (GPL in Debian) enters this library. A binary that
// contains it falls under the GPL; replacing fpca/detail/spline.cpp is all it takes to be rid of that.
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

}  // namespace kinespace
