// Interpolating cubic splines over a uniform grid, many curves at once.
//
// Samples stand in rows, curves in columns (row-major: one sample of all curves is contiguous), so that solving and
// evaluating run along the curves. Through y_0 .. y_{n-1} at x = 0, 1, .., n-1 the spline is the C2 piecewise cubic
// with "not-a-knot" ends; with three samples it is the parabola, with two the line, with one the constant.
//
//   on [i, i+1], b = x - i, a = 1 - b:   a y_i + b y_{i+1} + ((a^3 - a) M_i + (b^3 - b) M_{i+1}) / 6
//
// where M are the second derivatives. Derivatives are with respect to x (divide by the grid's step).
#pragma once

#include <Eigen/Core>

namespace kinespace {

// [sample][curve]
using SampleMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class UniformSpline {
 public:
  // `samples`: n >= 1 rows. Keeps a copy.
  explicit UniformSpline(SampleMatrix samples);

  [[nodiscard]] Eigen::Index samples() const { return y_.rows(); }
  [[nodiscard]] Eigen::Index curves() const { return y_.cols(); }

  // Values of all curves at x (clamped to [0, n-1]); `out` has curves() columns.
  void value(double x, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const;
  // First derivatives of the first out.size() curves.
  void derivative(double x, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const;
  // Integrals from 0 to every grid point: row i holds the integral over [0, i].
  [[nodiscard]] SampleMatrix cumulative_integral() const;

 private:
  SampleMatrix y_;
  SampleMatrix m_;  // second derivatives
};

}  // namespace kinespace
