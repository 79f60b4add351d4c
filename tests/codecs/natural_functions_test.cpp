#include "kinespace/codecs/stream/natural_functions.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/codecs/pose_space/time_blocks.h"

namespace kinespace {
namespace {

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t t = 0; t < a.size(); ++t) sum += a[t] * b[t];
  return sum;
}

TEST(NaturalFunctions, are_near_orthonormal) {
  const NaturalFunctions functions(400, 40);
  for (int a = 0; a < 40; ++a) {
    for (int b = 0; b < 40; ++b) {
      EXPECT_NEAR(product(functions.function(a), functions.function(b)), a == b ? 1 : 0, 2e-3) << a << " " << b;
    }
  }
}

TEST(NaturalFunctions, are_eigenfunctions_of_the_fourth_derivative_with_free_ends) {
  // phi'''' = b^4 phi inside; phi'' and phi''' vanish at the ends: checked by differences on a fine grid.
  const int n = 4000;
  const NaturalFunctions functions(n, 6);
  for (int k = 2; k < 6; ++k) {
    const std::vector<double> f = functions.function(k);
    const auto second = [&](std::size_t t) { return (f[t - 1] - 2 * f[t] + f[t + 1]) * n * n; };
    double largest = 0;
    for (std::size_t t = 1; t + 1 < f.size(); ++t) largest = std::max(largest, std::abs(second(t)));
    EXPECT_LT(std::abs(second(1)), 1e-3 * largest) << k;
    EXPECT_LT(std::abs(second(2) - second(1)) * n, 0.02 * largest * k * 3) << k;
    // The quotient f'''' / f where f is largest, over wide steps so that it is above rounding.
    std::size_t at = 1000;
    for (std::size_t t = 1000; t <= 3000; ++t) at = std::abs(f[t]) > std::abs(f[at]) ? t : at;
    const std::size_t h = 50;
    const double difference = f[at - 2 * h] - 4 * f[at - h] + 6 * f[at] - 4 * f[at + h] + f[at + 2 * h];
    const double fourth = difference * std::pow(static_cast<double>(n) / static_cast<double>(h), 4);
    const double expected = std::pow(k == 2 ? 4.730040744862704 : (k - 0.5) * 3.14159265358979, 4);
    EXPECT_NEAR(fourth / f[at] / expected, 1, 0.03) << k;
  }
}

TEST(NaturalFunctions, any_samples_are_a_sum_of_as_many_functions) {
  for (const int n : {1, 2, 3, 8, 31, 120}) {
    std::vector<double> curve;
    for (int t = 0; t < n; ++t) curve.push_back(std::sin(0.7 * t * t) + 3);
    const WindowTransform transform(n, n);
    std::vector<double> coefficients(curve.size());
    transform.analyse(curve.data(), n, 1, coefficients.data());
    std::vector<double> back(curve.size());
    NaturalFunctions(n, n).synthesise(coefficients, back);
    for (std::size_t t = 0; t < curve.size(); ++t) EXPECT_NEAR(back[t], curve[t], 1e-10) << n;
  }
}

// The root of the squares left by the first `count` cosines (the orthonormal transform of type II).
double left_by_cosines(const std::vector<double>& curve, int count) {
  const auto n = static_cast<double>(curve.size());
  double left = product(curve, curve);
  for (int k = 0; k < count; ++k) {
    double c = 0;
    for (std::size_t t = 0; t < curve.size(); ++t) {
      c += curve[t] * std::cos(3.14159265358979323846 * k * (static_cast<double>(t) + 0.5) / n);
    }
    left -= c * c * (k == 0 ? 1 : 2) / n;
  }
  return std::sqrt(left);
}

TEST(NaturalFunctions, leave_far_less_of_a_smooth_curve_with_free_ends_than_cosines) {
  const int n = 240;
  std::vector<double> curve;
  for (int t = 0; t < n; ++t) curve.push_back(0.02 * t + std::sin(0.03 * t + 1));
  for (const int count : {24, 48}) {
    const WindowTransform transform(n, count);
    std::vector<double> coefficients(static_cast<std::size_t>(count));
    transform.analyse(curve.data(), n, 1, coefficients.data());
    std::vector<double> back(curve.size());
    NaturalFunctions(n, count).synthesise(coefficients, back);
    for (std::size_t t = 0; t < curve.size(); ++t) back[t] -= curve[t];
    EXPECT_LT(std::sqrt(product(back, back)), 0.25 * left_by_cosines(curve, count)) << count;
  }
}

TEST(NaturalFunctions, own_sine_and_cosine_are_exact) {
  for (double x = -1000; x < 1000; x += 0.37) {
    double s = 0, c = 0;
    fixed_sin_cos(x, s, c);
    EXPECT_NEAR(s, std::sin(x), 2e-13);
    EXPECT_NEAR(c, std::cos(x), 2e-13);
  }
}

TEST(TimeBlocks, windows_cover_the_clip_and_begin_at_jumps) {
  const int frames = 1000;
  std::vector<double> curves(2 * frames);
  for (int t = 0; t < frames; ++t) {
    curves[static_cast<std::size_t>(t)] = 30 * std::sin(0.01 * t);
    curves[static_cast<std::size_t>(frames + t)] = t > 400 ? 20 * std::sin(0.4 * t) : 0;
  }
  const std::vector<int> jumps{333, 334};
  const std::vector<int> lengths = plan_blocks(curves, 2, frames, 60, jumps);
  int at = 0;
  std::vector<int> starts;
  for (const int n : lengths) {
    EXPECT_GE(n, 1);
    EXPECT_LE(n, 512);
    starts.push_back(at);
    at += n;
  }
  EXPECT_EQ(at, frames);
  for (const int jump : jumps) EXPECT_TRUE(std::ranges::find(starts, jump) != starts.end()) << jump;
}

TEST(TimeBlocks, what_changes_is_cut_where_it_changes) {
  const int frames = 480;
  std::vector<double> curve(frames, 0.0);
  for (int t = 240; t < frames; ++t) curve[static_cast<std::size_t>(t)] = 60 * std::sin(1.1 * t);
  const std::vector<int> lengths = plan_blocks(curve, 1, frames, 60, {});
  int at = 0;
  bool cut_there = false;
  for (const int n : lengths) cut_there = cut_there || (at += n) == 240;
  EXPECT_TRUE(cut_there);
}

}  // namespace
}  // namespace kinespace
