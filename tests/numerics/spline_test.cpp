#include "kinespace/numerics/spline.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

double cubic(double x) {
  return 1 - 2 * x + 0.5 * x * x - 3 * x * x * x;
}

TEST(Spline, with_four_point_ends_reproduces_a_cubic) {
  const std::vector<double> x = {0, 0.3, 0.5, 1.1, 1.2, 2}, at = {0, 0.1, 0.77, 1.9, 2, 2.3};
  std::vector<double> y(x.size());
  std::transform(x.begin(), x.end(), y.begin(), cubic);
  const auto out = interpolate_spline(x, y, at);
  for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(out[i], cubic(at[i]), 1e-11);
  const auto natural = interpolate_spline(x, y, at, SplineEnds::natural);
  EXPECT_GT(std::abs(natural[1] - cubic(at[1])), 1e-3);
}

TEST(Spline, passes_through_its_points) {
  const std::vector<double> x = {-1, 0, 2, 3, 7, 8}, y = {3, 1, 4, 1, 5, 9};
  for (const SplineEnds ends : {SplineEnds::natural, SplineEnds::four_point}) {
    const auto out = interpolate_spline(x, y, x, ends);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(out[i], y[i], 1e-12);
  }
}

TEST(Spline, natural_ends_do_not_bend) {
  const std::vector<double> x = {0, 1, 2, 3}, y = {0, 1, 0, 1};
  const double h = 1e-3;
  const std::vector<double> at = {0, h, 2 * h};
  const auto out = interpolate_spline(x, y, at, SplineEnds::natural);
  EXPECT_NEAR((out[0] - 2 * out[1] + out[2]) / (h * h), 0, 0.01);
}

TEST(Spline, of_one_two_and_three_points_is_a_constant_a_line_and_a_parabola) {
  const std::vector<double> at = {0.5, 1.5};
  EXPECT_EQ(interpolate_spline(std::vector<double>{1}, std::vector<double>{7}, at), (std::vector<double>{7, 7}));
  const auto line = interpolate_spline(std::vector<double>{0, 2}, std::vector<double>{1, 5}, at);
  EXPECT_NEAR(line[0], 2, 1e-12);
  EXPECT_NEAR(line[1], 4, 1e-12);
  const auto parabola = interpolate_spline(std::vector<double>{0, 1, 3}, std::vector<double>{0, 1, 9}, at);
  EXPECT_NEAR(parabola[0], 0.25, 1e-12);
  EXPECT_NEAR(parabola[1], 2.25, 1e-12);
}

TEST(Spline, refuses_places_that_do_not_ascend_and_sizes_that_differ) {
  const std::vector<double> at = {0.5};
  EXPECT_THROW((void)interpolate_spline(std::vector<double>{0, 1, 1}, std::vector<double>{0, 1, 2}, at), Error);
  EXPECT_THROW((void)interpolate_spline(std::vector<double>{0, 1}, std::vector<double>{0}, at), Error);
  EXPECT_THROW((void)interpolate_spline({}, {}, at), Error);
}

// x_i and a curve with noise.
struct NoisyCurve {
  std::vector<double> x, y, truth;
};

NoisyCurve noisy_curve(std::size_t count, double noise) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  NoisyCurve out;
  for (std::size_t i = 0; i < count; ++i) {
    out.x.push_back(static_cast<double>(i * i + 3 * i) / 400);
    out.truth.push_back(std::sin(out.x.back() / 2));
    out.y.push_back(out.truth.back() + noise * normal(random));
  }
  return out;
}

double criterion(const SmoothingSpline& g, const NoisyCurve& curve, double penalty, const std::vector<double>& change) {
  // The natural spline through changed values; its bend by second differences on a fine grid.
  std::vector<double> values = g.values, at;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += change[i];
  constexpr int fine = 20000;
  const double h = (curve.x.back() - curve.x.front()) / fine;
  for (int i = 0; i <= fine; ++i) at.push_back(curve.x.front() + i * h);
  const auto drawn = interpolate_spline(curve.x, values, at, SplineEnds::natural);
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) sum += std::pow(curve.y[i] - values[i], 2);
  for (std::size_t i = 1; i + 1 < at.size(); ++i) {
    sum += penalty * std::pow((drawn[i - 1] - 2 * drawn[i] + drawn[i + 1]) / (h * h), 2) * h;
  }
  return sum;
}

TEST(SmoothingSplines, are_the_least_of_what_they_say) {
  const NoisyCurve curve = noisy_curve(12, 0.3);
  const double penalty = 0.05;
  const SmoothingSpline g = smoothing_spline(curve.x, curve.y, penalty);
  const std::vector<double> none(curve.x.size());
  const double least = criterion(g, curve, penalty, none);
  EXPECT_NEAR(least, g.mean_square_residual * 12 + penalty * g.roughness, 1e-3 * least);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    for (const double by : {0.02, -0.02}) {
      std::vector<double> change = none;
      change[i] = by;
      EXPECT_GT(criterion(g, curve, penalty, change), least) << i;
    }
  }
}

TEST(SmoothingSplines, go_from_the_points_to_the_line_of_least_squares) {
  const NoisyCurve curve = noisy_curve(40, 0.3);
  EXPECT_EQ(smoothing_spline(curve.x, curve.y, 0).values, curve.y);
  const SmoothingSpline line = smoothing_spline(curve.x, curve.y, 1e9);
  EXPECT_LT(line.roughness, 1e-12);
  double sum = 0, first_moment = 0;  // residuals of least squares are orthogonal to 1 and x
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    sum += curve.y[i] - line.values[i];
    first_moment += (curve.y[i] - line.values[i]) * curve.x[i];
  }
  EXPECT_NEAR(sum, 0, 1e-6);
  EXPECT_NEAR(first_moment, 0, 1e-4);
}

TEST(SmoothingSplines, leave_as_much_as_there_is_noise_and_come_nearer_the_truth) {
  const NoisyCurve curve = noisy_curve(60, 0.2);
  const SmoothingSpline g = smoothing_spline_for_noise(curve.x, curve.y, 0.04);
  EXPECT_NEAR(g.mean_square_residual, 0.04, 1e-6);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    before += std::pow(curve.y[i] - curve.truth[i], 2);
    after += std::pow(g.values[i] - curve.truth[i], 2);
  }
  EXPECT_LT(after, 0.8 * before);
  EXPECT_EQ(smoothing_spline_for_noise(curve.x, curve.y, 0).values, curve.y);
  EXPECT_LT(smoothing_spline_for_noise(curve.x, curve.y, 1e3).roughness, 1e-9);
}

TEST(SmoothingSplines, pass_through_one_or_two_points_and_refuse_what_is_no_penalty) {
  EXPECT_EQ(smoothing_spline(std::vector<double>{1}, std::vector<double>{7}, 3).values, (std::vector<double>{7}));
  EXPECT_EQ(smoothing_spline_for_noise(std::vector<double>{1, 2}, std::vector<double>{7, 1}, 3).values,
            (std::vector<double>{7, 1}));
  EXPECT_THROW((void)smoothing_spline(std::vector<double>{1}, std::vector<double>{7}, -1), Error);
  EXPECT_THROW((void)smoothing_spline_for_noise(std::vector<double>{1}, std::vector<double>{7}, NAN), Error);
  EXPECT_THROW((void)smoothing_spline(std::vector<double>{1, 1}, std::vector<double>{7, 2}, 1), Error);
}

}  // namespace
}  // namespace kinespace
