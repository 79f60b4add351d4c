// Knees near full extension: smooth at any rate, and exact where the leg is bent.
#include "kinespace/footskate/detail/knee_bends.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

constexpr double half_leg = 40;

KneeHinge hinge_of(double bend) {
  return {.thigh = half_leg, .shin = half_leg, .share = 1, .bend = bend};
}

// A leg that is straight to `bend` radians and shall be shorter by `less_cm` from the middle of a second on.
std::vector<LegWish> shortened(double bend, double less_cm, double rate_hz) {
  std::vector<LegWish> out;
  for (int f = 0; f <= static_cast<int>(rate_hz); ++f) {
    const double x = std::clamp((f / rate_hz - 0.45) / 0.1, 0.0, 1.0);
    const KneeHinge hinge = hinge_of(bend);
    out.push_back({.hinge = hinge, .reach = hinge.reach(bend) - less_cm * x * x * (3 - 2 * x), .changes = true});
  }
  return out;
}

double largest_acceleration(const std::vector<double>& bends, double rate_hz) {
  double largest = 0;
  for (std::size_t f = 1; f + 1 < bends.size(); ++f) {
    largest = std::max(largest, std::abs(bends[f + 1] - 2 * bends[f] + bends[f - 1]) * rate_hz * rate_hz);
  }
  return largest;
}

std::vector<double> exact(const std::vector<LegWish>& wishes) {
  std::vector<double> out;
  for (const LegWish& leg : wishes) out.push_back(leg.hinge.bend_for(leg.reach));
  return out;
}

TEST(KneeBends, of_a_bent_leg_are_what_its_reach_asks_for) {
  const auto wishes = shortened(0.8, 1, 120);
  const auto bends = bends_for(wishes, 120, 0.0015);
  for (std::size_t f = 0; f < wishes.size(); ++f) {
    EXPECT_NEAR(wishes[f].hinge.reach(bends[f]), wishes[f].reach, 0.02) << f;
  }
}

TEST(KneeBends, of_a_straight_leg_do_not_jerk_and_miss_its_reach_by_millimetres) {
  for (const double rate : {60.0, 120.0, 240.0}) {
    const auto wishes = shortened(0, 0.3, rate);
    const auto bends = bends_for(wishes, rate, 0.15);
    EXPECT_LT(largest_acceleration(bends, rate), 0.25 * largest_acceleration(exact(wishes), rate)) << rate;
    for (std::size_t f = 0; f < wishes.size(); ++f) {
      EXPECT_NEAR(wishes[f].hinge.reach(bends[f]), wishes[f].reach, 0.2) << rate << " Hz, frame " << f;
    }
  }
}

TEST(KneeBends, are_the_same_at_any_rate) {
  const auto slow = bends_for(shortened(0, 0.3, 120), 120, 0.0015);
  const auto fast = bends_for(shortened(0, 0.3, 240), 240, 0.0015);
  for (std::size_t f = 0; f < slow.size(); ++f) EXPECT_NEAR(slow[f], fast[2 * f], 0.02) << f;
}

TEST(KneeBends, of_frames_that_do_not_change_stay) {
  auto wishes = shortened(0.02, 0.3, 120);
  for (std::size_t f = 0; f < wishes.size(); ++f) wishes[f].changes = f > 20 && f < 90;
  const auto bends = bends_for(wishes, 120, 0.15);
  for (std::size_t f = 0; f < wishes.size(); ++f) {
    if (wishes[f].changes) continue;
    EXPECT_EQ(bends[f], 0.02) << f;
  }
}

// A knee that was captured bent to the other side may stay so, but goes no further.
TEST(KneeBends, do_not_go_further_to_the_other_side) {
  auto wishes = shortened(-0.05, 0.3, 120);
  for (const double bend : bends_for(wishes, 120, 0.15)) EXPECT_GE(bend, -0.05);
}

TEST(KneeBends, of_one_frame_and_of_none_are_theirs) {
  EXPECT_TRUE(bends_for({}, 120, 0.15).empty());
  const auto one = bends_for({{.hinge = hinge_of(0.5), .reach = 77, .changes = true}}, 120, 0.0015);
  EXPECT_NEAR(hinge_of(0.5).reach(one.at(0)), 77, 0.01);
}

}  // namespace
}  // namespace kinespace
