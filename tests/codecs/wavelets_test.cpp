#include "kinespace/codecs/baselines/detail/wavelets.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

class Wavelets : public testing::TestWithParam<Wavelet> {};

TEST_P(Wavelets, curves_of_every_length_come_back) {
  std::vector<int> lengths(70);
  std::iota(lengths.begin(), lengths.end(), 1);
  lengths.insert(lengths.end(), {343, 1000, 1023, 1025, 20011});
  for (const int n : lengths) {
    const WaveletTransform transform(GetParam(), n);
    std::vector<double> curve, coefficients(static_cast<std::size_t>(n)), back(coefficients);
    for (int t = 0; t < n; ++t) curve.push_back(50 * std::sin(0.1 * t) + std::cos(3.3 * t * t) - t);
    transform.forward(curve, coefficients);
    transform.inverse(coefficients, back);
    for (std::size_t t = 0; t < curve.size(); ++t) ASSERT_NEAR(back[t], curve[t], 1e-9) << n;
    const std::vector<int> edges = transform.edges();
    EXPECT_EQ(edges.front(), 0);
    EXPECT_EQ(edges.back(), n);
    EXPECT_EQ(static_cast<int>(edges.size()), transform.levels() + 2);
    EXPECT_TRUE(n < WaveletTransform::shortest || edges[1] < WaveletTransform::shortest);
  }
}

TEST_P(Wavelets, cubics_have_no_details_away_from_the_ends) {
  const int n = 256;
  const WaveletTransform transform(GetParam(), n);
  std::vector<double> curve, coefficients(n);
  for (int t = 0; t < n; ++t) curve.push_back(1 + 0.3 * t - 0.02 * t * t + 1e-4 * t * t * t);
  transform.forward(curve, coefficients);
  const std::vector<int> edges = transform.edges();
  for (std::size_t band = static_cast<std::size_t>(transform.levels()); band > 2; --band) {
    const int first = edges[band], count = edges[band + 1] - first;
    if (count < 16) break;
    for (int k = 6; k < count - 6; ++k) EXPECT_NEAR(coefficients[static_cast<std::size_t>(first + k)], 0, 1e-8) << band;
  }
}

TEST_P(Wavelets, every_coefficient_stands_for_a_curve_of_about_unit_length) {
  for (const int n : {256, 343}) {
    const WaveletTransform transform(GetParam(), n);
    double sum = 0;
    for (int k = 0; k < n; ++k) {
      std::vector<double> unit(static_cast<std::size_t>(n)), curve(unit);
      unit[static_cast<std::size_t>(k)] = 1;
      transform.inverse(unit, curve);
      const double length = std::sqrt(std::inner_product(curve.begin(), curve.end(), curve.begin(), 0.0));
      EXPECT_GT(length, 0.6) << k;
      EXPECT_LT(length, 1.5) << k;
      sum += length;
    }
    EXPECT_NEAR(sum / n, 1, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Both, Wavelets, testing::Values(Wavelet::cdf97, Wavelet::cubic_interpolating));

}  // namespace
}  // namespace kinespace
