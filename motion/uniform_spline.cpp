#include "kinespace/motion/uniform_spline.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace kinespace {
namespace {

// Second derivatives of the not-a-knot spline. Inside, M_{i-1} + 4 M_i + M_{i+1} = 6 (y_{i-1} - 2 y_i + y_{i+1}); the
// third derivative is continuous at the second and the last but one sample, so M_0 = 2 M_1 - M_2 and likewise at the
// end, which leaves 6 M_1 = 6 (...) in the first and last equation of the tridiagonal system.
SampleMatrix second_derivatives(const SampleMatrix& y) {
  const Eigen::Index n = y.rows();
  SampleMatrix m = SampleMatrix::Zero(n, y.cols());
  if (n < 3) return m;
  if (n == 3) {
    m.row(0) = y.row(0) - 2 * y.row(1) + y.row(2);
    m.row(1) = m.row(0);
    m.row(2) = m.row(0);
    return m;
  }
  const Eigen::Index inner = n - 2;
  std::vector<double> upper(static_cast<std::size_t>(inner), 0.0);
  m.row(1) = y.row(0) - 2 * y.row(1) + y.row(2);  // 6 M_1 = 6 (...)
  for (Eigen::Index i = 2; i <= inner; ++i) {
    const bool last = i == inner;
    const double lower = last ? 0.0 : 1.0;
    const double before = upper[static_cast<std::size_t>(i - 2)];
    const double pivot = (last ? 6.0 : 4.0) - lower * before;
    upper[static_cast<std::size_t>(i - 1)] = last ? 0.0 : 1.0 / pivot;
    m.row(i) = (6 * (y.row(i - 1) - 2 * y.row(i) + y.row(i + 1)) - lower * m.row(i - 1)) / pivot;
  }
  for (Eigen::Index i = inner - 1; i >= 1; --i) m.row(i) -= upper[static_cast<std::size_t>(i - 1)] * m.row(i + 1);
  m.row(0) = 2 * m.row(1) - m.row(2);
  m.row(n - 1) = 2 * m.row(n - 2) - m.row(n - 3);
  return m;
}

struct Cell {
  Eigen::Index i;
  double b;
};

// The interval that holds x, and where in it; the last sample belongs to the last interval.
Cell cell_of(double x, Eigen::Index n) {
  const double clamped = std::clamp(x, 0.0, static_cast<double>(n - 1));
  const auto i = std::min(static_cast<Eigen::Index>(clamped), n - 2);
  return {i, clamped - static_cast<double>(i)};
}

}  // namespace

UniformSpline::UniformSpline(SampleMatrix samples) : y_(std::move(samples)), m_(second_derivatives(y_)) {
  assert(y_.rows() >= 1);
}

void UniformSpline::value(double x, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const {
  const Eigen::Index k = out.size();
  if (y_.rows() == 1) {
    out = y_.row(0).head(k);
    return;
  }
  const auto [i, b] = cell_of(x, y_.rows());
  const double a = 1 - b;
  const double ca = (a * a * a - a) / 6;
  const double cb = (b * b * b - b) / 6;
  out = a * y_.row(i).head(k) + b * y_.row(i + 1).head(k) + ca * m_.row(i).head(k) + cb * m_.row(i + 1).head(k);
}

void UniformSpline::derivative(double x, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const {
  const Eigen::Index k = out.size();
  if (y_.rows() == 1) {
    out.setZero();
    return;
  }
  const auto [i, b] = cell_of(x, y_.rows());
  const double a = 1 - b;
  const double ca = (1 - 3 * a * a) / 6;
  const double cb = (3 * b * b - 1) / 6;
  out = y_.row(i + 1).head(k) - y_.row(i).head(k) + ca * m_.row(i).head(k) + cb * m_.row(i + 1).head(k);
}

SampleMatrix UniformSpline::cumulative_integral() const {
  SampleMatrix sum = SampleMatrix::Zero(y_.rows(), y_.cols());
  for (Eigen::Index i = 0; i + 1 < y_.rows(); ++i) {
    sum.row(i + 1) = sum.row(i) + (y_.row(i) + y_.row(i + 1)) / 2 - (m_.row(i) + m_.row(i + 1)) / 24;
  }
  return sum;
}

}  // namespace kinespace
