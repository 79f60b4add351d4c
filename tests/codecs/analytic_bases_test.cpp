#include "kinespace/codecs/baselines/detail/analytic_bases.h"

#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace kinespace {
namespace {

// [function][point], all that there are.
Eigen::MatrixXd polynomials(int points, const std::vector<int>& degrees) {
  const DiscreteLegendre basis(points);
  Eigen::MatrixXd out(static_cast<Eigen::Index>(degrees.size()), points);
  std::vector<double> half(static_cast<std::size_t>(basis.half()));
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    basis.function(degrees[i], half);
    for (int t = 0; t < basis.half(); ++t) {
      const double value = half[static_cast<std::size_t>(t)];
      out(static_cast<Eigen::Index>(i), points - 1 - t) = degrees[i] % 2 == 0 ? value : -value;
      out(static_cast<Eigen::Index>(i), t) = value;
    }
  }
  return out;
}

double off_orthonormal(const Eigen::MatrixXd& rows) {
  return (rows * rows.transpose() - Eigen::MatrixXd::Identity(rows.rows(), rows.rows())).cwiseAbs().maxCoeff();
}

std::vector<double> some_curve(int points) {
  std::vector<double> out;
  for (int t = 0; t < points; ++t) out.push_back(20 * std::sin(0.37 * t) + 0.1 * t + 3 * std::cos(2.9 * t * t));
  return out;
}

TEST(DiscreteLegendre, polynomials_of_every_degree_are_orthonormal_on_the_samples) {
  for (const int points : {1, 2, 3, 8, 71, 300, 301}) {
    std::vector<int> degrees;
    for (int k = 0; k < points; ++k) degrees.push_back(k);
    EXPECT_LT(off_orthonormal(polynomials(points, degrees)), 1e-11) << points;
  }
}

TEST(DiscreteLegendre, high_degrees_on_many_samples_stay_orthonormal) {
  EXPECT_LT(off_orthonormal(polynomials(10000, {0, 1, 2, 50, 300, 301, 700, 1500, 4000, 9998, 9999})), 1e-10);
}

TEST(DiscreteLegendre, on_a_fine_grid_they_are_the_legendre_polynomials) {
  const int points = 4001;
  const Eigen::MatrixXd rows = polynomials(points, {2});
  const double scale = std::sqrt(2.0 / points) * std::sqrt(2.5);
  for (int t = 0; t < points; t += 100) {
    const double x = (2.0 * t + 1) / points - 1;
    EXPECT_NEAR(rows(0, t), scale * (1.5 * x * x - 0.5), 1e-5 * scale * 100);
  }
}

TEST(DiscreteLegendre, all_coefficients_give_the_curves_back_and_the_first_few_a_cubic) {
  for (const int points : {1, 2, 9, 60, 61}) {
    const DiscreteLegendre basis(points);
    std::vector<double> curves = some_curve(points);
    for (int t = 0; t < points; ++t) curves.push_back(1 + 0.5 * t - 0.01 * t * t + 1e-4 * t * t * t);
    std::vector<double> coefficients(curves.size()), back(curves.size());
    basis.analyse(basis.fold(curves, 2), 2, 0, points, coefficients, points);
    basis.synthesise(coefficients, 2, points, points, back);
    for (std::size_t i = 0; i < curves.size(); ++i) EXPECT_NEAR(back[i], curves[i], 1e-10) << points;
    basis.synthesise(coefficients, 2, points, std::min(points, 4), back);
    for (auto i = static_cast<std::size_t>(points); i < curves.size(); ++i) EXPECT_NEAR(back[i], curves[i], 1e-10);
  }
}

TEST(DiscreteFourier, functions_are_orthonormal_and_ordered_from_slow_to_fast) {
  for (const int points : {1, 2, 3, 4, 17, 64, 100, 101}) {
    const DiscreteFourier basis(points);
    Eigen::MatrixXd rows(points, points);
    std::vector<double> unit(static_cast<std::size_t>(points)), curve(unit.size());
    for (int k = 0; k < points; ++k) {
      unit.assign(unit.size(), 0.0);
      unit[static_cast<std::size_t>(k)] = 1;
      basis.synthesise(unit, curve);
      for (int t = 0; t < points; ++t) rows(k, t) = curve[static_cast<std::size_t>(t)];
      const int cycles = (k + 1) / 2;
      const bool cosine = k % 2 == 1 || k == 0;
      const double scale = std::sqrt((k == 0 || 2 * cycles == points ? 1.0 : 2.0) / points);
      const double angle = 2 * std::numbers::pi * cycles / points;
      EXPECT_NEAR(rows(k, points / 3),
                  scale * (cosine ? std::cos(angle * (points / 3)) : std::sin(angle * (points / 3))), 1e-12);
    }
    EXPECT_LT(off_orthonormal(rows), 1e-12) << points;
  }
}

TEST(DiscreteFourier, all_coefficients_give_the_curve_back) {
  for (const int points : {1, 2, 7, 343, 2048, 10007}) {
    const DiscreteFourier basis(points);
    const std::vector<double> curve = some_curve(points);
    std::vector<double> coefficients(curve.size()), back(curve.size());
    basis.analyse(curve, coefficients);
    basis.synthesise(coefficients, back);
    for (std::size_t t = 0; t < curve.size(); ++t) ASSERT_NEAR(back[t], curve[t], 1e-8) << points;
  }
}

}  // namespace
}  // namespace kinespace
