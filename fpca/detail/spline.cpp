#include "kinespace/fpca/detail/spline.h"

#include <array>
#include <cmath>
#include <string>

#include <interpolation.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// ALGLIB reports by its own exception, which must not leave this file.
template <typename Work>
auto through_alglib(const Work& work) {
  try {
    return work();
  } catch (const alglib::ap_error& error) {
    throw Error(ErrorKind::usage,
                {.found = "ALGLIB: " + error.msg, .expected = "points that a spline can pass through"});
  }
}

// The spline through (x, y) with the given second derivatives at its ends.
alglib::spline1dinterpolant build(std::span<const double> x, std::span<const double> y, double left, double right) {
  alglib::real_1d_array ax, ay;
  ax.setcontent(static_cast<alglib::ae_int_t>(x.size()), x.data());
  ay.setcontent(static_cast<alglib::ae_int_t>(y.size()), y.data());
  alglib::spline1dinterpolant spline;
  constexpr alglib::ae_int_t second_derivative = 2;
  alglib::spline1dbuildcubic(ax, ay, static_cast<alglib::ae_int_t>(x.size()), second_derivative, left,
                             second_derivative, right, spline);
  return spline;
}

double second_derivative(const alglib::spline1dinterpolant& spline, double x) {
  double value = 0, first = 0, second = 0;
  alglib::spline1ddiff(spline, x, value, first, second);
  return second;
}

// Third derivatives of the spline's first and last piece; second derivatives are linear on a piece.
std::array<double, 2> end_jerks(const alglib::spline1dinterpolant& spline, std::span<const double> x) {
  const std::size_t n = x.size();
  return {(second_derivative(spline, x[1]) - second_derivative(spline, x[0])) / (x[1] - x[0]),
          (second_derivative(spline, x[n - 1]) - second_derivative(spline, x[n - 2])) / (x[n - 1] - x[n - 2])};
}

// Six times the third divided difference of four points: the third derivative of the cubic through them.
double cubic_jerk(std::span<const double> x, std::span<const double> y) {
  std::array<double, 4> d = {y[0], y[1], y[2], y[3]};
  for (std::size_t order = 1; order < 4; ++order) {
    for (std::size_t i = 0; i + order < 4; ++i) d[i] = (d[i + 1] - d[i]) / (x[i + order] - x[i]);
  }
  return 6 * d[0];
}

// The second derivatives at the ends that make the end pieces have the wanted third derivatives. The spline is linear
// in its end conditions, so two splines through zero and one through the data say it all.
std::array<double, 2> four_point_ends(std::span<const double> x, std::span<const double> y) {
  const std::size_t n = x.size();
  const std::vector<double> zero(n, 0.0);
  const std::array<double, 2> base = end_jerks(build(x, y, 0, 0), x);
  const std::array<double, 2> left = end_jerks(build(x, zero, 1, 0), x);
  const std::array<double, 2> right = end_jerks(build(x, zero, 0, 1), x);
  const double want_left = cubic_jerk(x.first(4), y.first(4)) - base[0];
  const double want_right = cubic_jerk(x.last(4), y.last(4)) - base[1];
  const double det = left[0] * right[1] - right[0] * left[1];
  return {(want_left * right[1] - right[0] * want_right) / det, (left[0] * want_right - left[1] * want_left) / det};
}

// The second derivative of the parabola through three points.
double parabola_curvature(std::span<const double> x, std::span<const double> y) {
  return 2 * ((y[2] - y[1]) / (x[2] - x[1]) - (y[1] - y[0]) / (x[1] - x[0])) / (x[2] - x[0]);
}

void require_ascending(std::span<const double> x, std::span<const double> y) {
  if (x.empty() || x.size() != y.size()) {
    throw Error(ErrorKind::usage,
                {.found = std::to_string(x.size()) + " places and " + std::to_string(y.size()) + " values",
                 .expected = "as many places as values, at least one"});
  }
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (!(x[i] > x[i - 1])) {
      throw Error(ErrorKind::usage, {.found = "place " + std::to_string(i + 1) + " not above the one before it",
                                     .expected = "places in ascending order"});
    }
  }
}

}  // namespace

std::vector<double> interpolate_spline(std::span<const double> x, std::span<const double> y, std::span<const double> at,
                                       SplineEnds ends) {
  require_ascending(x, y);
  if (x.size() == 1) return std::vector<double>(at.size(), y[0]);
  return through_alglib([&] {
    std::array<double, 2> curvature = {0, 0};
    if (ends == SplineEnds::four_point && x.size() == 3) curvature.fill(parabola_curvature(x, y));
    if (ends == SplineEnds::four_point && x.size() > 3) curvature = four_point_ends(x, y);
    const alglib::spline1dinterpolant spline = build(x, y, curvature[0], curvature[1]);
    std::vector<double> out;
    out.reserve(at.size());
    for (const double place : at) out.push_back(alglib::spline1dcalc(spline, place));
    return out;
  });
}

}  // namespace kinespace
