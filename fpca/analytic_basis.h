// Fixed orthonormal bases on a grid: what curves are compared with before a basis of their own is worth having
// (yoo2019, table 6).
//
// The functions are orthonormal in the trapezoid inner product of the T points themselves, not only as continuous
// functions, so that coefficients are inner products, the fit is the weighted least-squares fit, and a prefix of the
// coefficients is the best fit with fewer functions. This holds up to T functions, where every curve is met exactly.
#pragma once

#include <cstdint>

#include "kinespace/fpca/curve_moments.h"
#include "kinespace/fpca/functional_pca.h"

namespace kinespace {

enum class AnalyticFamily : std::uint8_t {
  // 1, sin 2 pi u, cos 2 pi u, sin 4 pi u, ... with the domain as period. T points with both ends carry T - 1 of them
  // (the ends are one point of the circle); the last function of a complete basis is the difference of the ends.
  fourier,
  // Polynomials of degree 0, 1, 2, ...: Legendre's, made orthonormal on the grid (Gram polynomials).
  legendre,
};

class AnalyticBasis {
 public:
  // `count` functions, 1 <= count <= points, on a regular grid over the domain. Throws Error{usage}.
  AnalyticBasis(AnalyticFamily family, int points, int count, Domain domain = {});

  [[nodiscard]] const Eigen::MatrixXd& functions() const noexcept { return functions_; }  // T x count
  [[nodiscard]] const Eigen::VectorXd& weights() const noexcept { return weights_; }      // of the trapezoid rule

  // n x count, for n curves of T points.
  [[nodiscard]] CurveMatrix coefficients(const CurveView& curves) const;
  // n x T, from the first m <= count coefficients of each curve.
  [[nodiscard]] CurveMatrix reconstruct(const CurveView& coefficients) const;

 private:
  Eigen::VectorXd weights_;
  Eigen::MatrixXd functions_;
};

}  // namespace kinespace
