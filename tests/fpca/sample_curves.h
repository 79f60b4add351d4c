// Curves whose functional principal components are known in closed form:
//   y(u) = mu(u) + sum_k sqrt(lambda_k) z_k sqrt(2) cos(k pi u) + noise,   lambda = 1, 0.4, 0.15, 0.05, 0.01.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "kinespace/fpca/curve_moments.h"

namespace kinespace::test {

inline constexpr double sample_eigenvalues[] = {1, 0.4, 0.15, 0.05, 0.01};

inline double sample_mean(double u) {
  return std::sin(2 * std::numbers::pi * u) + 2 * u;
}
inline double sample_function(int k, double u) {
  return std::numbers::sqrt2 * std::cos((k + 1) * std::numbers::pi * u);
}

// The generator and the transform are fixed, so these are the same curves everywhere.
inline double standard_normal(std::mt19937& generator) {
  const double a = (static_cast<double>(generator()) + 1) / 4294967297.0;
  const double b = static_cast<double>(generator()) / 4294967296.0;
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * std::numbers::pi * b);
}

inline CurveMatrix sample_curves(int count, int points, double noise = 0, unsigned seed = 1) {
  std::mt19937 generator(seed);
  CurveMatrix out(count, points);
  for (int i = 0; i < count; ++i) {
    double scores[5];
    for (int k = 0; k < 5; ++k) scores[k] = std::sqrt(sample_eigenvalues[k]) * standard_normal(generator);
    for (int t = 0; t < points; ++t) {
      const double u = points > 1 ? static_cast<double>(t) / (points - 1) : 0;
      out(i, t) = sample_mean(u) + noise * standard_normal(generator);
      for (int k = 0; k < 5; ++k) out(i, t) += scores[k] * sample_function(k, u);
    }
  }
  return out;
}

inline CurveMatrix random_curves(int count, int points, unsigned seed) {
  std::mt19937 generator(seed);
  CurveMatrix out(count, points);
  for (int i = 0; i < count; ++i) {
    for (int t = 0; t < points; ++t) out(i, t) = standard_normal(generator);
  }
  return out;
}

}  // namespace kinespace::test
