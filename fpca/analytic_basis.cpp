#include "kinespace/fpca/analytic_basis.h"

#include <cmath>
#include <numbers>
#include <string>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// Columns orthonormal in the plain dot product; those of the basis are these over the roots of the weights.
class Orthonormal {
 public:
  Orthonormal(Eigen::Index points, Eigen::Index count) : columns_(points, count) {}

  // Adds what `column` has beyond the columns so far, or nothing when that is rounding. Subtracting twice is enough
  // (Kahan, Parlett).
  bool add(Eigen::VectorXd column) {
    const double before = column.norm();
    for (int pass = 0; pass < 2; ++pass) {
      const auto known = columns_.leftCols(used_);
      column -= known * (known.transpose() * column);
    }
    constexpr double rounding = 1e-10;
    if (full() || !(column.norm() > rounding * before)) return false;
    columns_.col(used_++) = column.normalized();
    return true;
  }
  [[nodiscard]] bool full() const { return used_ == columns_.cols(); }
  [[nodiscard]] auto last() const { return columns_.col(used_ - 1); }
  [[nodiscard]] const Eigen::MatrixXd& columns() const { return columns_; }

 private:
  Eigen::MatrixXd columns_;
  Eigen::Index used_ = 0;
};

// `root` holds the roots of the weights.
void add_fourier(const Eigen::ArrayXd& u, const Eigen::ArrayXd& root, Orthonormal& basis) {
  basis.add(root.matrix());
  for (Eigen::Index k = 1; !basis.full() && 2 * k <= u.size(); ++k) {
    // The angle over whole turns, by the remainder, so that the ends agree to the last bit and sines at the grid's own
    // highest frequency vanish.
    const Eigen::ArrayXd turns = u * static_cast<double>(k);
    const Eigen::ArrayXd angle = 2 * std::numbers::pi * (turns - turns.round());
    const Eigen::ArrayXd sine = angle.sin();
    if (sine.abs().maxCoeff() > 1e-9) basis.add((root * sine).matrix());
    basis.add((root * angle.cos()).matrix());
  }
  if (basis.full()) return;
  Eigen::ArrayXd ends = Eigen::ArrayXd::Zero(u.size());
  ends[0] = -1;
  ends[u.size() - 1] = 1;
  basis.add((root * ends).matrix());
}

// u times the last polynomial, less all before it: the three-term recurrence with its rounding taken away (Lanczos).
void add_polynomials(const Eigen::ArrayXd& u, const Eigen::ArrayXd& root, Orthonormal& basis) {
  basis.add(root.matrix());
  const Eigen::ArrayXd centred = 2 * u - 1;
  while (!basis.full() && basis.add((centred * basis.last().array()).matrix())) {
  }
}

void require_columns(Eigen::Index found, Eigen::Index expected) {
  if (found == expected) return;
  throw Error(ErrorKind::usage, {.found = std::to_string(found) + " columns", .expected = std::to_string(expected)});
}

}  // namespace

AnalyticBasis::AnalyticBasis(AnalyticFamily family, int points, int count, Domain domain) {
  if (points < 1 || count < 1 || count > points) {
    throw Error(ErrorKind::usage,
                {.found = std::to_string(count) + " functions on " + std::to_string(points) + " points",
                 .expected = "1 to as many functions as points"});
  }
  weights_ = trapezoid_weights(points, domain.length());
  const Eigen::ArrayXd root = weights_.array().sqrt();
  const Eigen::ArrayXd u =
      points > 1 ? Eigen::ArrayXd(Eigen::ArrayXd::LinSpaced(points, 0, 1)) : Eigen::ArrayXd::Zero(1);
  Orthonormal basis(points, count);
  family == AnalyticFamily::fourier ? add_fourier(u, root, basis) : add_polynomials(u, root, basis);
  functions_ = root.inverse().matrix().asDiagonal() * basis.columns();
}

CurveMatrix AnalyticBasis::coefficients(const CurveView& curves) const {
  require_columns(curves.cols(), weights_.size());
  return curves * (weights_.asDiagonal() * functions_);
}

CurveMatrix AnalyticBasis::reconstruct(const CurveView& coefficients) const {
  if (coefficients.cols() > functions_.cols()) require_columns(coefficients.cols(), functions_.cols());
  return coefficients * functions_.leftCols(coefficients.cols()).transpose();
}

}  // namespace kinespace
