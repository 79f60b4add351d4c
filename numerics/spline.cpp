#include "kinespace/numerics/spline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

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

// Second derivatives at the points of the spline through them, those at its ends given: for each inner point
// h_l c_l + 2 (h_l + h_r) c + h_r c_r = 6 ((y_r - y) / h_r - (y - y_l) / h_l), three diagonals that need no pivots.
std::vector<double> curvatures(std::span<const double> x, std::span<const double> y, double left, double right) {
  const std::size_t n = x.size();
  std::vector<double> c(n), above(n);
  c.front() = left;
  c.back() = right;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = x[i] - x[i - 1], after = x[i + 1] - x[i];
    const double pivot = 2 * (before + after) - before * above[i - 1];
    above[i] = after / pivot;
    c[i] = (6 * ((y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before) - before * c[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) c[i] -= above[i] * c[i + 1];
  return c;
}

// Third derivatives of the first and the last piece.
std::array<double, 2> end_jerks(std::span<const double> x, std::span<const double> c) {
  const std::size_t n = x.size();
  return {(c[1] - c[0]) / (x[1] - x[0]), (c[n - 1] - c[n - 2]) / (x[n - 1] - x[n - 2])};
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
  const std::vector<double> zero(x.size(), 0.0);
  const std::array<double, 2> base = end_jerks(x, curvatures(x, y, 0, 0));
  const std::array<double, 2> left = end_jerks(x, curvatures(x, zero, 1, 0));
  const std::array<double, 2> right = end_jerks(x, curvatures(x, zero, 0, 1));
  const double want_left = cubic_jerk(x.first(4), y.first(4)) - base[0];
  const double want_right = cubic_jerk(x.last(4), y.last(4)) - base[1];
  const double det = left[0] * right[1] - right[0] * left[1];
  return {(want_left * right[1] - right[0] * want_right) / det, (left[0] * want_right - left[1] * want_left) / det};
}

// The second derivative of the parabola through three points.
double parabola_curvature(std::span<const double> x, std::span<const double> y) {
  return 2 * ((y[2] - y[1]) / (x[2] - x[1]) - (y[1] - y[0]) / (x[1] - x[0])) / (x[2] - x[0]);
}

// The piece that holds `place`, or the outermost.
double spline_value(std::span<const double> x, std::span<const double> y, std::span<const double> c, double place) {
  const auto after = std::upper_bound(x.begin() + 1, x.end() - 1, place);
  const auto i = static_cast<std::size_t>(after - x.begin()) - 1;
  const double h = x[i + 1] - x[i], from = place - x[i];
  const double slope = (y[i + 1] - y[i]) / h - h * (2 * c[i] + c[i + 1]) / 6;
  return y[i] + from * (slope + from * (c[i] / 2 + from * (c[i + 1] - c[i]) / (6 * h)));
}

// Row i of Q' y: the change of slope at inner point i + 1.
double slope_change(std::span<const double> x, std::span<const double> y, std::size_t i) {
  return (y[i + 2] - y[i + 1]) / (x[i + 2] - x[i + 1]) - (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
}

// R + penalty Q'Q, the diagonal and the two above it; R_ii = (h_i + h_{i+1}) / 3, R_{i,i+1} = h_{i+1} / 6.
struct Band {
  std::vector<double> diagonal, first, second;
};

Band smoothing_system(std::span<const double> x, double penalty) {
  const std::size_t inner = x.size() - 2;
  std::vector<double> inverse(x.size() - 1);
  for (std::size_t i = 0; i + 1 < x.size(); ++i) inverse[i] = 1 / (x[i + 1] - x[i]);
  const auto middle = [&](std::size_t i) { return -inverse[i] - inverse[i + 1]; };  // of column i of Q
  Band band{std::vector<double>(inner), std::vector<double>(inner), std::vector<double>(inner)};
  for (std::size_t i = 0; i < inner; ++i) {
    const double a = inverse[i], b = middle(i), c = inverse[i + 1];
    band.diagonal[i] = (x[i + 2] - x[i]) / 3 + penalty * (a * a + b * b + c * c);
    if (i + 1 < inner) band.first[i] = (x[i + 2] - x[i + 1]) / 6 + penalty * (b * inverse[i + 1] + c * middle(i + 1));
    if (i + 2 < inner) band.second[i] = penalty * c * inverse[i + 2];
  }
  return band;
}

// By L D L' within the band, which overwrites it; the matrix is positive definite.
void solve(Band& band, std::vector<double>& b) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = band.diagonal[i];
    const double l1 = band.first[i] / pivot, l2 = band.second[i] / pivot;
    if (i + 1 < n) {
      band.diagonal[i + 1] -= l1 * band.first[i];
      band.first[i + 1] -= l1 * band.second[i];
      b[i + 1] -= l1 * b[i];
    }
    if (i + 2 < n) {
      band.diagonal[i + 2] -= l2 * band.second[i];
      b[i + 2] -= l2 * b[i];
    }
    band.first[i] = l1;
    band.second[i] = l2;
  }
  for (std::size_t i = n; i-- > 0;) {
    b[i] /= band.diagonal[i];
    if (i + 1 < n) b[i] -= band.first[i] * b[i + 1];
    if (i + 2 < n) b[i] -= band.second[i] * b[i + 2];
  }
}

}  // namespace

std::vector<double> interpolate_spline(std::span<const double> x, std::span<const double> y, std::span<const double> at,
                                       SplineEnds ends) {
  require_ascending(x, y);
  if (x.size() == 1) return std::vector<double>(at.size(), y[0]);
  std::array<double, 2> ends_curve = {0, 0};
  if (ends == SplineEnds::four_point && x.size() == 3) ends_curve.fill(parabola_curvature(x, y));
  if (ends == SplineEnds::four_point && x.size() > 3) ends_curve = four_point_ends(x, y);
  const std::vector<double> c = curvatures(x, y, ends_curve[0], ends_curve[1]);
  std::vector<double> out;
  out.reserve(at.size());
  for (const double place : at) out.push_back(spline_value(x, y, c, place));
  return out;
}

SmoothingSpline smoothing_spline(std::span<const double> x, std::span<const double> y, double penalty) {
  require_ascending(x, y);
  if (!(penalty >= 0) || !std::isfinite(penalty)) {
    throw Error(ErrorKind::usage, {.found = "penalty = " + std::to_string(penalty), .expected = "0 or more, finite"});
  }
  SmoothingSpline out{.values = {y.begin(), y.end()}, .penalty = penalty};
  if (x.size() < 3) return out;
  std::vector<double> c(x.size() - 2);
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = slope_change(x, y, i);
  Band band = smoothing_system(x, penalty);
  solve(band, c);
  // Q c, row by row.
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double before = 1 / (x[i + 1] - x[i]), after = 1 / (x[i + 2] - x[i + 1]);
    out.values[i] -= penalty * before * c[i];
    out.values[i + 1] += penalty * (before + after) * c[i];
    out.values[i + 2] -= penalty * after * c[i];
  }
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += (y[i] - out.values[i]) * (y[i] - out.values[i]);
  out.mean_square_residual = squares / static_cast<double>(x.size());
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {  // g'' is a straight line between knots, 0 at the ends
    const double left = i == 0 ? 0 : c[i - 1], right = i == c.size() ? 0 : c[i];
    out.roughness += (x[i + 1] - x[i]) * (left * left + left * right + right * right) / 3;
  }
  return out;
}

SmoothingSpline smoothing_spline_for_noise(std::span<const double> x, std::span<const double> y,
                                           double noise_variance) {
  if (!(noise_variance >= 0) || !std::isfinite(noise_variance)) {
    throw Error(ErrorKind::usage,
                {.found = "noise_variance = " + std::to_string(noise_variance), .expected = "0 or more, finite"});
  }
  SmoothingSpline low = smoothing_spline(x, y, 0);
  if (noise_variance == 0 || x.size() < 3) return low;
  // The residual grows with the penalty, from 0 to that of a straight line. A penalty that bends a curve over the whole
  // domain is of the size of length^3; 1e15 times less and more is the one end and the other.
  const double length = x.back() - x.front();
  double low_log = std::log(length * length * length) - 35, high_log = low_log + 70;
  const SmoothingSpline line = smoothing_spline(x, y, std::exp(high_log));
  if (line.mean_square_residual <= noise_variance) return line;
  constexpr int halvings = 60;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (low_log + high_log) / 2;
    SmoothingSpline tried = smoothing_spline(x, y, std::exp(middle));
    if (tried.mean_square_residual > noise_variance) {
      high_log = middle;
    } else {
      low_log = middle;
      low = std::move(tried);
    }
  }
  return low;
}

}  // namespace kinespace
