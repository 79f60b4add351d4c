// Count, mean and scatter of curves: what a principal component analysis needs of them, and all that has to travel
// between threads, machines or runs.
//
// A curve is T numbers, one for each point of a grid. With n curves y_i and mean m the scatter is
//
//   S = sum (y_i - m)(y_i - m)'
//
// Blocks are centred on their own means before they are multiplied, and joined by Chan's rule (Chan, Golub, LeVeque
// 1983)
//
//   S = S_a + S_b + n_a n_b / (n_a + n_b) (m_b - m_a)(m_b - m_a)',
//
// so a mean far from zero costs no digits, and moments of two halves merged equal those of all curves up to rounding.
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace kinespace {

// One curve a row.
using CurveMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using CurveView = Eigen::Ref<const CurveMatrix>;

class CurveMoments {
 public:
  // No curves yet, of `points` >= 1 points. Throws Error{usage}.
  explicit CurveMoments(int points);
  // From stored parts. `scatter` is points x points; its lower triangle is read. Throws Error{usage} when sizes
  // disagree.
  CurveMoments(std::int64_t count, const Eigen::VectorXd& mean, const Eigen::MatrixXd& scatter);

  // Adds a block of curves. Throws Error{bad_input} naming the first curve (within the block, from 1) and point that is
  // not finite; the moments are then as before. Throws Error{usage} when the block has another number of points.
  void add(const CurveView& curves);
  // Adds what `other` has seen.
  void merge(const CurveMoments& other);

  [[nodiscard]] std::int64_t count() const noexcept { return count_; }
  [[nodiscard]] int points() const noexcept { return static_cast<int>(mean_.size()); }
  [[nodiscard]] const Eigen::VectorXd& mean() const noexcept { return mean_; }
  // The whole symmetric matrix.
  [[nodiscard]] Eigen::MatrixXd scatter() const;
  // scatter / divisor, written to `out` (resized).
  void covariance(double divisor, Eigen::MatrixXd& out) const;

 private:
  void add_block(const CurveView& block, CurveMatrix& buffer);

  std::int64_t count_ = 0;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd scatter_;  // lower triangle
};

// Throws Error{bad_input} naming the first curve and point (from 1) that is not finite; returns when all are.
void require_finite(const CurveView& curves);

}  // namespace kinespace
