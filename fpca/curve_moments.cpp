#include "kinespace/fpca/curve_moments.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/fpca/detail/blas.h"

namespace kinespace {
namespace {

// Rows of a block: about 256 KiB, which stays in the second-level cache between centring and multiplying.
Eigen::Index block_rows(Eigen::Index points) {
  return std::clamp<Eigen::Index>(32768 / points, 32, 1024);
}

void require_points(Eigen::Index found, Eigen::Index expected) {
  if (found == expected) return;
  throw Error(ErrorKind::usage, {.found = "curves of " + std::to_string(found) + " points",
                                 .expected = std::to_string(expected) + " points"});
}

}  // namespace

void require_finite(const CurveView& curves) {
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    for (Eigen::Index t = 0; t < curves.cols(); ++t) {
      if (std::isfinite(curves(i, t))) continue;
      throw Error(ErrorKind::bad_input, {.found = "a value that is not a finite number in curve " +
                                                  std::to_string(i + 1) + " at point " + std::to_string(t + 1),
                                         .expected = "finite numbers"});
    }
  }
}

CurveMoments::CurveMoments(int points) {
  if (points < 1) {
    throw Error(ErrorKind::usage,
                {.found = "curves of " + std::to_string(points) + " points", .expected = "at least 1 point"});
  }
  mean_.setZero(points);
  scatter_.setZero(points, points);
}

CurveMoments::CurveMoments(std::int64_t count, const Eigen::VectorXd& mean, const Eigen::MatrixXd& scatter)
    : CurveMoments(static_cast<int>(mean.size())) {
  require_points(scatter.rows(), mean.size());
  require_points(scatter.cols(), mean.size());
  if (count < 0) throw Error(ErrorKind::usage, {.found = std::to_string(count) + " curves", .expected = "0 or more"});
  count_ = count;
  mean_ = mean;
  scatter_ = scatter;
}

void CurveMoments::add(const CurveView& curves) {
  require_points(curves.cols(), points());
  if (curves.rows() == 0) return;
  blas::use_one_thread();
  const Eigen::Index step = block_rows(points());
  CurveMatrix buffer(std::min(step, curves.rows()) + 1, points());
  CurveMoments added(points());
  for (Eigen::Index first = 0; first < curves.rows(); first += step) {
    added.add_block(curves.middleRows(first, std::min(step, curves.rows() - first)), buffer);
  }
  // A value that is not finite makes its sums so; looking for it beforehand would cost a pass over the curves.
  if (!added.mean_.allFinite() || !added.scatter_.diagonal().allFinite()) {
    require_finite(curves);
    throw Error(ErrorKind::bad_input,
                {.found = "values too large to be squared", .expected = "magnitudes below 1e150"});
  }
  merge(added);
}

// The buffer holds the block's curves less the block's mean and, as one more row, the step from the mean so far to the
// block's, scaled so that its square is Chan's correction: one product then adds both.
void CurveMoments::add_block(const CurveView& block, CurveMatrix& buffer) {
  const Eigen::Index rows = block.rows(), width = block.cols();
  Eigen::RowVectorXd block_mean = Eigen::RowVectorXd::Zero(width);
  for (Eigen::Index i = 0; i < rows; ++i) block_mean += block.row(i);
  block_mean /= static_cast<double>(rows);
  for (Eigen::Index i = 0; i < rows; ++i) buffer.row(i) = block.row(i) - block_mean;
  const double before = static_cast<double>(count_), now = static_cast<double>(rows), all = before + now;
  buffer.row(rows) = std::sqrt(before / all * now) * (block_mean - mean_.transpose());
  blas::add_gram(buffer.data(), rows + (count_ > 0 ? 1 : 0), width, width, scatter_.data());
  mean_ += now / all * (block_mean.transpose() - mean_);
  count_ += rows;
}

void CurveMoments::merge(const CurveMoments& other) {
  require_points(other.points(), points());
  if (other.count_ == 0) return;
  if (count_ == 0) {
    *this = other;
    return;
  }
  const double a = static_cast<double>(count_), b = static_cast<double>(other.count_);
  const Eigen::VectorXd step = other.mean_ - mean_;
  for (Eigen::Index j = 0; j < step.size(); ++j) {
    const Eigen::Index below = step.size() - j;
    scatter_.col(j).tail(below) += other.scatter_.col(j).tail(below) + a / (a + b) * b * step[j] * step.tail(below);
  }
  mean_ += b / (a + b) * step;
  count_ += other.count_;
}

void CurveMoments::covariance(double divisor, Eigen::MatrixXd& out) const {
  out.resize(points(), points());
  for (Eigen::Index j = 0; j < points(); ++j) {
    for (Eigen::Index i = j; i < points(); ++i) {
      out(i, j) = scatter_(i, j) / divisor;
      out(j, i) = out(i, j);
    }
  }
}

Eigen::MatrixXd CurveMoments::scatter() const {
  Eigen::MatrixXd out;
  covariance(1, out);
  return out;
}

}  // namespace kinespace
