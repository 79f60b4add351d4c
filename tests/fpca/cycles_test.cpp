#include "kinespace/fpca/cycles.h"

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/support/error_of.h"

namespace kinespace {
namespace {

constexpr int limbs = 4;

// A hip and four limbs of 40 cm.
Skeleton limb_skeleton() {
  using enum Channel;
  Skeleton out;
  out.joints.push_back(
      {"hip", -1, {0, 90, 0}, {x_position, y_position, z_position, z_rotation, x_rotation, y_rotation}, {}});
  for (int i = 0; i < limbs; ++i) {
    const Eigen::Vector3d side(i % 2 == 0 ? 10 : -10, 0, 0);
    out.joints.push_back(
        {"limb" + std::to_string(i), 0, side, {z_rotation, x_rotation, y_rotation}, Eigen::Vector3d(0, -40, 0)});
  }
  return out;
}

using Angles = std::array<double, limbs>;
using Motion = std::function<Angles(double seconds)>;

Clip clip_of(const Motion& motion, double rate_hz, int frames) {
  Clip clip = make_clip("limbs", limb_skeleton(), rate_hz, frames);
  for (int f = 0; f < frames; ++f) {
    const Angles angles = motion(f / rate_hz);
    for (int i = 0; i < limbs; ++i) {
      const double angle = angles[static_cast<std::size_t>(i)];
      clip.set_rotation(i + 1, f, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())));
    }
  }
  return clip;
}

// Limbs that swing against each other, as those of a walk do; phase in cycles.
Angles swing(double phase, double size = 1) {
  const double a = 2 * std::numbers::pi * phase;
  return {size * 0.5 * std::sin(a), -size * 0.5 * std::sin(a), size * (0.4 * std::cos(a) + 0.1 * std::sin(2 * a)),
          size * (0.1 * std::sin(2 * a) - 0.4 * std::cos(a))};
}

Motion swinging(double cycle_s) {
  return [cycle_s](double t) { return swing(t / cycle_s); };
}

// Of recordings: a tenth of a degree or so, each frame by itself.
Motion with_noise(const Motion& motion, double size = 0.002) {
  return [motion, size, noise = std::mt19937(7)](double t) mutable {
    Angles out = motion(t);
    for (double& angle : out) angle += size * (static_cast<double>(noise()) / 4294967296.0 - 0.5);
    return out;
  };
}

std::vector<CyclicStretch> cycles_of(const Clip& clip, const CycleOptions& options = {}) {
  const ClipCurves curves = clip_curves(clip);
  return find_cycles(curves, clip.skeleton, 0, clip.frames - 1, options);
}

// In order, inside and apart.
void expect_legal(const std::vector<CyclicStretch>& stretches, int first, int last) {
  int free = first;
  for (const CyclicStretch& stretch : stretches) {
    ASSERT_GE(stretch.marks.size(), 2U);
    EXPECT_GE(stretch.marks.front(), free);
    for (std::size_t i = 1; i < stretch.marks.size(); ++i) EXPECT_LT(stretch.marks[i - 1], stretch.marks[i]);
    EXPECT_GE(stretch.end, stretch.marks.back());
    free = stretch.end + 1;
  }
  EXPECT_LE(free - 1, last);
}

double mean_cycle(const CyclicStretch& stretch) {
  return static_cast<double>(stretch.marks.back() - stretch.marks.front()) / stretch.cycles();
}

TEST(Cycles, the_period_is_found_at_any_rate) {
  for (const double rate : {12.0, 29.97, 30.0, 120.0, 240.0}) {
    for (const double cycle_s : {0.45, 0.83, 1.1, 1.9}) {
      const int frames = static_cast<int>(16 * rate);
      const auto stretches = cycles_of(clip_of(with_noise(swinging(cycle_s)), rate, frames));
      SCOPED_TRACE(std::to_string(cycle_s) + " s at " + std::to_string(rate));
      ASSERT_EQ(stretches.size(), 1U);
      expect_legal(stretches, 0, frames - 1);
      const CyclicStretch& stretch = stretches.front();
      EXPECT_EQ(stretch.marks.front(), 0);
      EXPECT_GE(stretch.cycles(), static_cast<int>(16 / cycle_s) - 1);
      EXPECT_NEAR(mean_cycle(stretch), cycle_s * rate, std::min(1.0, 0.01 * cycle_s * rate));
      for (std::size_t i = 1; i < stretch.marks.size(); ++i) {
        EXPECT_NEAR(stretch.marks[i], static_cast<double>(i) * cycle_s * rate, std::max(1.0, rate / 30)) << i;
      }
      EXPECT_LT(stretch.difference, 0.05);
    }
  }
}

TEST(Cycles, every_whole_cycle_of_a_clip_is_found) {
  const auto stretches = cycles_of(clip_of(swinging(1), 30, 601));
  ASSERT_EQ(stretches.size(), 1U);
  EXPECT_EQ(stretches[0].cycles(), 20);
  EXPECT_EQ(stretches[0].end, 600);
}

TEST(Cycles, a_cycle_that_grows_longer_is_followed) {
  // T = 0.8 + 0.4 t / 12 seconds: the integral of 1 / T, and where it is whole.
  const auto phase = [](double t) { return 30 * std::log(1 + t / 24); };
  const auto time = [](double whole) { return 24 * (std::exp(whole / 30) - 1); };
  for (const double rate : {30.0, 120.0}) {
    const Clip clip = clip_of(with_noise([&](double t) { return swing(phase(t)); }), rate, static_cast<int>(12 * rate));
    const auto stretches = cycles_of(clip);
    ASSERT_EQ(stretches.size(), 1U);
    const CyclicStretch& stretch = stretches.front();
    EXPECT_GE(stretch.cycles(), 11);
    for (std::size_t i = 1; i < stretch.marks.size(); ++i) {
      const double truth = time(static_cast<double>(i)) - time(static_cast<double>(i) - 1);
      EXPECT_NEAR((stretch.marks[i] - stretch.marks[i - 1]) / rate, truth, 0.05) << i;
      EXPECT_NEAR(stretch.marks[i] / rate, time(static_cast<double>(i)), 0.06) << i;
    }
  }
}

TEST(Cycles, a_body_that_stands_repeats_nothing) {
  const Motion still = [](double) { return swing(0.1); };
  EXPECT_TRUE(cycles_of(clip_of(still, 30, 600)).empty());
  for (const double size : {1e-7, 1e-4, 0.002, 0.02}) {
    EXPECT_TRUE(cycles_of(clip_of(with_noise(still, size), 30, 600)).empty()) << size;
  }
}

TEST(Cycles, what_is_not_repeated_is_no_cycle) {
  EXPECT_TRUE(cycles_of(clip_of(swinging(1), 30, 15)).empty());
  EXPECT_TRUE(cycles_of(clip_of(swinging(1), 30, 36)).empty());
  EXPECT_TRUE(cycles_of(clip_of(swinging(2), 30, 72)).empty());
  EXPECT_TRUE(cycles_of(clip_of([](double t) { return Angles{0.1 * t, -0.1 * t, 0.05 * t, 0}; }, 30, 300)).empty());
}

TEST(Cycles, less_than_two_cycles_hold_a_whole_one) {
  for (const double cycle_s : {0.7, 1.0, 1.5}) {
    const auto stretches = cycles_of(clip_of(with_noise(swinging(cycle_s)), 30.0, static_cast<int>(58.5 * cycle_s)));
    ASSERT_EQ(stretches.size(), 1U) << cycle_s;
    EXPECT_EQ(stretches[0].cycles(), 1);
    EXPECT_NEAR(mean_cycle(stretches[0]), 30 * cycle_s, 1);
  }
}

TEST(Cycles, a_limp_is_one_cycle_of_two_steps) {
  // Steps of 0.5 s, every second one smaller: the limbs of both sides as one.
  const auto limp = [](double t) {
    const double step = std::sin(2 * std::numbers::pi * t);
    const double lift = step > 0 ? step : -0.4 * step;
    return Angles{0.5 * lift, 0.3 * lift, -0.4 * lift, 0.2 * lift};
  };
  const auto stretches = cycles_of(clip_of(with_noise(limp), 30, 360));
  ASSERT_EQ(stretches.size(), 1U);
  EXPECT_NEAR(mean_cycle(stretches[0]), 30, 0.3);
  // Steps that are alike are the cycle themselves.
  const auto even = [](double t) {
    const double lift = std::abs(std::sin(2 * std::numbers::pi * t));
    return Angles{0.5 * lift, 0.3 * lift, -0.4 * lift, 0.2 * lift};
  };
  const auto steps = cycles_of(clip_of(with_noise(even), 30, 360));
  ASSERT_EQ(steps.size(), 1U);
  EXPECT_NEAR(mean_cycle(steps[0]), 15, 0.3);
}

TEST(Cycles, stillness_parts_two_stretches) {
  for (const double cycle_s : {0.7, 1.0, 1.4}) {
    const Motion motion = [cycle_s](double t) {
      if (t < 6 * cycle_s) return swing(t / cycle_s);
      if (t < 6 * cycle_s + 4) return swing(0);
      return swing((t - 4) / cycle_s);
    };
    const int frames = static_cast<int>(30 * (12 * cycle_s + 4));
    const auto stretches = cycles_of(clip_of(with_noise(motion), 30, frames));
    ASSERT_EQ(stretches.size(), 2U) << cycle_s;
    expect_legal(stretches, 0, frames - 1);
    const double half = 15 * cycle_s;
    EXPECT_NEAR(stretches[0].end, 30 * 6 * cycle_s, half);
    EXPECT_NEAR(stretches[1].marks.front(), 30 * (6 * cycle_s + 4), half);
    for (const CyclicStretch& stretch : stretches) {
      EXPECT_GE(stretch.cycles(), 5);
      EXPECT_NEAR(mean_cycle(stretch), 30 * cycle_s, 1);
      for (std::size_t i = 1; i < stretch.marks.size(); ++i) {
        EXPECT_NEAR(stretch.marks[i] - stretch.marks[i - 1], 30 * cycle_s, 3) << i;
      }
    }
  }
}

TEST(Cycles, two_gaits_are_two_stretches_without_a_common_frame) {
  const Motion motion = [](double t) {
    if (t < 6) return swing(t);
    const Angles a = swing((t - 6) / 0.6, 1.4);
    return Angles{a[2], a[3], a[1], a[0]};
  };
  const auto stretches = cycles_of(clip_of(with_noise(motion), 30, 360));
  ASSERT_EQ(stretches.size(), 2U);
  expect_legal(stretches, 0, 359);
  EXPECT_NEAR(mean_cycle(stretches[0]), 30, 1);
  EXPECT_NEAR(mean_cycle(stretches[1]), 18, 1);
}

TEST(Cycles, only_the_frames_asked_for_are_looked_at) {
  for (const double rate : {30.0, 25.0, 120.0}) {
    const Clip clip = clip_of(with_noise(swinging(1)), rate, static_cast<int>(20 * rate));
    const int first = static_cast<int>(3.3 * rate);
    const int last = static_cast<int>(9.1 * rate);
    const auto stretches = find_cycles(clip_curves(clip), clip.skeleton, first, last);
    ASSERT_EQ(stretches.size(), 1U);
    expect_legal(stretches, first, last);
    EXPECT_NEAR(stretches[0].marks.front(), first, rate / 30 + 1);
    EXPECT_NEAR(stretches[0].end, last, rate / 30 + 1);
    EXPECT_EQ(stretches[0].cycles(), 5);
  }
}

TEST(Cycles, clips_of_one_two_and_few_frames_have_none) {
  for (const double rate : {0.5, 30.0, 240.0}) {
    for (const int frames : {1, 2, 3, 10}) {
      EXPECT_TRUE(cycles_of(clip_of(swinging(1), rate, frames)).empty()) << rate << ' ' << frames;
    }
  }
}

TEST(Cycles, a_long_clip_begins_as_its_beginning_does) {
  const Motion motion = with_noise([](double t) { return swing(t + 0.8 * std::sin(0.1 * t)); });
  const Clip clip = clip_of(motion, 30, 100'000);
  const auto all = cycles_of(clip);
  const auto some = cycles_of(slice(clip, 0, 3000));
  ASSERT_EQ(all.size(), 1U);
  ASSERT_EQ(some.size(), 1U);
  EXPECT_NEAR(all[0].cycles(), 100'000 / 30.0, 3);
  for (std::size_t i = 0; i + 5 < some[0].marks.size(); ++i) EXPECT_EQ(all[0].marks[i], some[0].marks[i]) << i;
  // Nor does it lose its pace farther on: cycles last 30 / 1.08 to 30 / 0.92 frames.
  for (std::size_t i = 1; i < all[0].marks.size(); ++i) {
    ASSERT_NEAR(all[0].marks[i] - all[0].marks[i - 1], 30.2, 3.8) << i;
  }
}

TEST(Cycles, lengths_out_of_range_are_not_looked_for) {
  const Clip clip = clip_of(with_noise(swinging(2)), 30, 600);
  EXPECT_TRUE(cycles_of(clip, {.longest_s = 1.7}).empty());
  EXPECT_EQ(cycles_of(clip).size(), 1U);
  // Then twice the cycle is one.
  const auto pairs = cycles_of(clip, {.shortest_s = 3, .longest_s = 5});
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_NEAR(mean_cycle(pairs[0]), 120, 1);
}

TEST(Cycles, options_out_of_range_are_named) {
  const auto found = [](const CycleOptions& options) {
    const Error error = test::error_of([&] { options.validate(); });
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    return error.details().found;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(found({.shortest_s = 0}), "CycleOptions::shortest_s = 0");
  EXPECT_EQ(found({.shortest_s = nan}), "CycleOptions::shortest_s = nan");
  EXPECT_EQ(found({.shortest_s = 2, .longest_s = 1}), "CycleOptions::longest_s = 1");
  EXPECT_EQ(found({.longest_s = 1e9}), "CycleOptions::longest_s = 1000000000");
  EXPECT_EQ(found({.most_difference = 0}), "CycleOptions::most_difference = 0");
  EXPECT_EQ(found({.most_difference = 1.5}), "CycleOptions::most_difference = 1.5");
  EXPECT_NO_THROW(CycleOptions{}.validate());
}

}  // namespace
}  // namespace kinespace
