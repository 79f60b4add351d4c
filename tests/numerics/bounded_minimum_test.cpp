#include "kinespace/numerics/bounded_minimum.h"

#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

BoxPoint point(double x, double y) {
  BoxPoint out(2);
  out << x, y;
  return out;
}

// Rosenbrock 1960: a bent valley, least at (1, 1).
double valley(const BoxPoint& x, BoxPoint& gradient) {
  const double across = x[1] - x[0] * x[0], along = 1 - x[0];
  gradient[0] = -400 * across * x[0] - 2 * along;
  gradient[1] = 200 * across;
  return 100 * across * across + along * along;
}

TEST(BoxMinimum, follows_a_bent_valley_to_its_end) {
  const BoxMinimum found = minimise_in_box(valley, point(-1.2, 1), point(-2, -2), point(2, 2));
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.at - point(1, 1)).norm(), 1e-5);
  EXPECT_LT(found.evaluations, 80);
}

TEST(BoxMinimum, stops_at_a_border_and_slides_along_it) {
  // With x <= 0.5 the valley's least place is (0.5, 0.25); with y >= 1.5 it is where the slope in x vanishes.
  const BoxMinimum side = minimise_in_box(valley, point(-1.2, 1), point(-2, -2), point(0.5, 2));
  EXPECT_EQ(side.at[0], 0.5);
  EXPECT_NEAR(side.at[1], 0.25, 1e-7);
  const BoxMinimum above = minimise_in_box(valley, point(1.9, 1.9), point(0, 1.5), point(2, 2));
  EXPECT_EQ(above.at[1], 1.5);
  BoxPoint slope(2);
  static_cast<void>(valley(above.at, slope));
  EXPECT_NEAR(slope[0], 0, 1e-4);
}

TEST(BoxMinimum, of_a_plane_is_its_lowest_corner) {
  const BoxFunction plane = [](const BoxPoint& x, BoxPoint& gradient) {
    gradient << -1e-3, 1e5;
    return -1e-3 * x[0] + 1e5 * x[1];
  };
  const BoxMinimum found = minimise_in_box(plane, point(0.2, 0.7), point(0, -1), point(1e4, 1));
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.at, point(1e4, -1));
}

TEST(BoxMinimum, leaves_a_saddle_downwards) {
  const BoxFunction saddle = [](const BoxPoint& x, BoxPoint& gradient) {
    gradient << 2 * x[0], -2 * x[1];
    return x[0] * x[0] - x[1] * x[1];
  };
  const BoxMinimum found = minimise_in_box(saddle, point(0.5, 1e-3), point(-1, -1), point(1, 1));
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.at[1], 1);
  EXPECT_NEAR(found.at[0], 0, 1e-6);
}

TEST(BoxMinimum, is_never_above_the_start_and_counts_what_it_asks) {
  int asked = 0;
  const BoxFunction counted = [&](const BoxPoint& x, BoxPoint& gradient) {
    ++asked;
    return valley(x, gradient);
  };
  for (int most = 1; most < 12; ++most) {
    asked = 0;
    const BoxMinimum found =
        minimise_in_box(counted, point(-1.2, 1), point(-2, -2), point(2, 2), {.most_evaluations = most});
    EXPECT_LE(found.value, 24.2 + 1e-12);
    EXPECT_EQ(found.evaluations, asked);
    EXPECT_LE(asked, most);
    EXPECT_FALSE(found.converged);
  }
}

TEST(BoxMinimum, in_a_box_without_width_is_its_place) {
  const BoxMinimum found = minimise_in_box(valley, point(0, 0), point(0.3, -2), point(0.3, 2));
  EXPECT_EQ(found.at[0], 0.3);
  EXPECT_NEAR(found.at[1], 0.09, 1e-7);
}

TEST(BoxMinimum, refuses_what_is_no_box) {
  EXPECT_THROW((void)minimise_in_box(valley, point(0, 0), point(1, 0), point(0, 1)), Error);
  EXPECT_THROW((void)minimise_in_box(valley, point(0, NAN), point(-1, -1), point(1, 1)), Error);
  EXPECT_THROW((void)minimise_in_box(valley, BoxPoint(), BoxPoint(), BoxPoint()), Error);
  EXPECT_THROW((void)minimise_in_box(valley, point(0, 0), point(-1, -1), point(1, 1), {.last_step = 0}), Error);
  EXPECT_THROW((void)minimise_in_box(valley, point(0, 0), point(-1, -1), point(1, 1), {.first_step = 2}), Error);
  EXPECT_THROW((void)minimise_in_box(valley, point(0, 0), point(-1, -1), point(1, 1), {.most_evaluations = 0}), Error);
}

}  // namespace
}  // namespace kinespace
