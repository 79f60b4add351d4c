#include "kinespace/fpca/detail/spline.h"

#include <algorithm>
#include <cmath>
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

}  // namespace
}  // namespace kinespace
