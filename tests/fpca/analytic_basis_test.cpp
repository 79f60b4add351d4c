#include "kinespace/fpca/analytic_basis.h"

#include <cmath>
#include <numbers>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/fpca/sample_curves.h"

namespace kinespace {
namespace {

constexpr AnalyticFamily families[] = {AnalyticFamily::fourier, AnalyticFamily::legendre};

TEST(AnalyticBasis, is_orthonormal_and_complete_with_as_many_functions_as_points) {
  for (const AnalyticFamily family : families) {
    for (const int points : {1, 2, 3, 4, 31, 100, 301}) {
      const AnalyticBasis basis(family, points, points, {0, 1.5});
      const Eigen::MatrixXd gram = basis.functions().transpose() * basis.weights().asDiagonal() * basis.functions();
      EXPECT_LE((gram - Eigen::MatrixXd::Identity(points, points)).cwiseAbs().maxCoeff(), 1e-12) << points;
      const CurveMatrix y = test::random_curves(5, points, 3);
      EXPECT_LE((basis.reconstruct(basis.coefficients(y)) - y).cwiseAbs().maxCoeff(), 1e-10) << points;
    }
  }
}

TEST(AnalyticBasis, fourier_holds_the_constant_and_whole_waves) {
  constexpr int points = 41;
  const AnalyticBasis basis(AnalyticFamily::fourier, points, 9);
  for (int t = 0; t < points; ++t) {
    const double angle = 2 * std::numbers::pi * t / (points - 1);
    EXPECT_NEAR(basis.functions()(t, 0), 1, 1e-12);
    EXPECT_NEAR(basis.functions()(t, 1), std::numbers::sqrt2 * std::sin(angle), 1e-12);
    EXPECT_NEAR(basis.functions()(t, 8), std::numbers::sqrt2 * std::cos(4 * angle), 1e-12);
  }
}

TEST(AnalyticBasis, legendre_holds_polynomials) {
  constexpr int points = 60;
  const AnalyticBasis basis(AnalyticFamily::legendre, points, 6);
  CurveMatrix y(1, points);
  for (int t = 0; t < points; ++t) {
    const double u = static_cast<double>(t) / (points - 1);
    y(0, t) = 1 - 3 * u + 7 * std::pow(u, 5);
  }
  EXPECT_LE((basis.reconstruct(basis.coefficients(y)) - y).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT((basis.reconstruct(basis.coefficients(y).leftCols(5)) - y).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(AnalyticBasis, legendre_nears_the_continuous_polynomials_on_fine_grids) {
  constexpr int points = 4001;
  const AnalyticBasis basis(AnalyticFamily::legendre, points, 4);
  for (const int t : {0, 500, 2000, 4000}) {
    const double x = 2.0 * t / (points - 1) - 1;
    EXPECT_NEAR(basis.functions()(t, 3), std::sqrt(7.0) * 0.5 * (5 * x * x * x - 3 * x), 1e-4);
  }
}

TEST(AnalyticBasis, a_prefix_is_the_weighted_least_squares_fit) {
  const CurveMatrix y = test::sample_curves(4, 50, 0.1);
  for (const AnalyticFamily family : families) {
    const AnalyticBasis many(family, 50, 20), few(family, 50, 7);
    const CurveMatrix prefix = many.coefficients(y).leftCols(7);
    EXPECT_LE((prefix - few.coefficients(y)).cwiseAbs().maxCoeff(), 1e-12);
    const Eigen::VectorXd root = few.weights().cwiseSqrt();
    const Eigen::MatrixXd fit =
        (root.asDiagonal() * few.functions()).householderQr().solve(root.asDiagonal() * y.transpose());
    EXPECT_LE((fit.transpose() - prefix).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(AnalyticBasis, refuses_counts_that_do_not_fit) {
  EXPECT_THROW(AnalyticBasis(AnalyticFamily::fourier, 10, 11), Error);
  EXPECT_THROW(AnalyticBasis(AnalyticFamily::fourier, 10, 0), Error);
  EXPECT_THROW(AnalyticBasis(AnalyticFamily::legendre, 0, 0), Error);
  const AnalyticBasis basis(AnalyticFamily::legendre, 10, 3);
  EXPECT_THROW((void)basis.coefficients(CurveMatrix::Zero(2, 9)), Error);
  EXPECT_THROW((void)basis.reconstruct(CurveMatrix::Zero(2, 4)), Error);
}

}  // namespace
}  // namespace kinespace
