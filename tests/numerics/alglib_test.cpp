// Our own numerics beside ALGLIB's: a build without it gives the same results.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <interpolation.h>

#include "kinespace/alglib/minimum.h"
#include "kinespace/numerics/spline.h"

namespace kinespace {
namespace {

std::vector<double> ascending(std::mt19937_64& random, int count) {
  std::uniform_real_distribution<double> step(0.05, 1);
  std::vector<double> out{0};
  while (std::ssize(out) < count) out.push_back(out.back() + step(random));
  return out;
}

std::vector<double> normal(std::mt19937_64& random, std::size_t count) {
  std::normal_distribution<double> value;
  std::vector<double> out(count);
  for (double& v : out) v = value(random);
  return out;
}

alglib::real_1d_array array_of(const std::vector<double>& values) {
  alglib::real_1d_array out;
  out.setcontent(static_cast<alglib::ae_int_t>(values.size()), values.data());
  return out;
}

TEST(Alglib, draws_the_same_spline_through_points) {
  std::mt19937_64 random(1);
  for (const int count : {2, 3, 4, 5, 17, 200}) {
    const std::vector<double> x = ascending(random, count), y = normal(random, x.size());
    std::vector<double> at = x;
    for (const double place : x) at.push_back(place + 0.02);
    at.push_back(-0.5);
    const std::vector<double> ours = interpolate_spline(x, y, at, SplineEnds::natural);
    alglib::spline1dinterpolant theirs;
    alglib::spline1dbuildcubic(array_of(x), array_of(y), count, 2, 0, 2, 0, theirs);
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(ours[i], alglib::spline1dcalc(theirs, at[i]), 1e-9);
  }
}

// Of all curves with so little bend ours is the nearest to the points, so that of ALGLIB's penalised regression spline,
// whose penalty is not the integral, cannot be nearer; and it is near enough to be the same kind of curve.
TEST(Alglib, smooths_no_better) {
  std::mt19937_64 random(2);
  const int count = 100;
  std::vector<double> x(count), y = normal(random, count);
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    x[k] = i / (count - 1.0);
    y[k] = 0.2 * y[k] + std::sin(9 * x[k]);
  }
  for (const double lambda : {1e-4, 1e-2, 1.0}) {
    alglib::spline1dinterpolant theirs;
    alglib::spline1dfitreport report;
    alglib::spline1dfit(array_of(x), array_of(y), count, count, lambda, theirs, report);
    double squares = 0, roughness = 0;
    constexpr int parts = 64;  // of a piece between knots
    for (std::size_t i = 0; i < x.size(); ++i) {
      squares += std::pow(y[i] - alglib::spline1dcalc(theirs, x[i]), 2);
      for (int p = 0; p < parts && i + 1 < x.size(); ++p) {
        double value = 0, first = 0, second = 0;
        alglib::spline1ddiff(theirs, x[i] + (p + 0.5) / parts * (x[i + 1] - x[i]), value, first, second);
        roughness += second * second * (x[i + 1] - x[i]) / parts;
      }
    }
    const SmoothingSpline ours = smoothing_spline_for_noise(x, y, squares / count);
    EXPECT_LE(ours.roughness, roughness * (1 + 1e-9)) << lambda;
    EXPECT_GE(ours.roughness, 0.3 * roughness) << lambda;
  }
}

TEST(Alglib, finds_the_same_minimum_in_a_box) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int on_border = 0;
  for (int trial = 0; trial < 200; ++trial) {
    // A convex function that is no parabola: sums of log cosh.
    Eigen::Matrix<double, 5, 3> a;
    Eigen::Matrix<double, 5, 1> b;
    for (double& value : a.reshaped()) value = uniform(random);
    for (double& value : b) value = 2 * uniform(random);
    const BoxFunction function = [&](const BoxPoint& x, BoxPoint& gradient) {
      const Eigen::Matrix<double, 5, 1> r = a * x - b;
      gradient = a.transpose() * r.array().tanh().matrix();
      return r.array().cosh().log().sum();
    };
    const BoxPoint lower = BoxPoint::Constant(3, -1), upper = BoxPoint::Constant(3, 1.5), start = BoxPoint::Zero(3);
    const BoxMinimum ours = minimise_in_box(function, start, lower, upper);
    const BoxMinimum theirs = alglib_minimise_in_box(function, start, lower, upper);
    EXPECT_TRUE(ours.converged);
    EXPECT_TRUE(theirs.converged);
    EXPECT_NEAR(ours.value, theirs.value, 1e-9 * theirs.value) << trial;
    on_border += (ours.at.array() == -1 || ours.at.array() == 1.5).any() ? 1 : 0;
  }
  EXPECT_GT(on_border, 50);
  EXPECT_LT(on_border, 195);
}

}  // namespace
}  // namespace kinespace
