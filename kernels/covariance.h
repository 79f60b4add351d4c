// Mean and covariance of curves on a common grid, streamed, and mergeable.
//
//   mean = sum y / n        covariance = sum (y - mean)(y - mean)' / (n - d),   d = 1 unless told otherwise
//
// Curves come in any number at a time and are not kept. They are gathered in blocks of 1024; each block is centred by a
// shift (the mean of the first block, so that cancellation is harmless), its scatter is one SYRK, and count, sums and
// scatters are added in double, in the order of the curves. So the result depends neither on threads nor on how the
// curves were divided into calls.
//
// Precision: with single-precision blocks (the default: twice the rate) entries are exact to about 1e-6 of the largest,
// and the floor under the small eigenvalues is 3e-8 of the first for 1000 curves, 2e-9 for 200 000; with double blocks,
// 1e-14 and 1e-15. merge() is exact to rounding in double: two halves with double blocks merge to what all curves give,
// to 1e-12.
#pragma once

#include <cstdint>
#include <memory>

#include "kinespace/kernels/device.h"
#include "kinespace/kernels/matrix.h"

namespace kinespace {

enum class BlockPrecision : std::uint8_t { single_precision, double_precision };

struct CurveCovariance {
  std::int64_t count = 0;
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

class CovarianceStream {
 public:
  // `points` of a curve, >= 1. Throws Error{usage} for others.
  explicit CovarianceStream(int points, BlockPrecision precision = BlockPrecision::single_precision,
                            Compute compute = {});

  [[nodiscard]] int points() const { return points_; }
  [[nodiscard]] std::int64_t count() const { return count_ + pending_; }

  // Adds curves, one a row. Throws Error{usage} for another number of points.
  void add(const RowMatrixView<float>& curves);

  // Adds the curves of another stream of as many points. Throws Error{usage} for others.
  void merge(const CovarianceStream& other);

  // `lost`: degrees of freedom taken off the count, 0 or 1. Throws Error{usage} when count() <= lost, and
  // Error{bad_input} when some curve held a number that is not finite.
  [[nodiscard]] CurveCovariance result(int lost = 1) const;

 private:
  void choose_shift();
  void add_blocks(const float* curves, Eigen::Index stride, Eigen::Index count);
  void flush();

  int points_;
  BlockPrecision precision_;
  Compute compute_;
  std::int64_t count_ = 0;     // curves in sum_ and scatter_
  Eigen::Index pending_ = 0;   // curves in block_
  RowMatrix<float> block_;     // curves of a block that is not full
  Eigen::RowVectorXf shift_;   // empty before the first block
  Eigen::RowVectorXd sum_;     // of y - shift
  RowMatrix<double> scatter_;  // of y - shift, lower half
};

// All at once.
[[nodiscard]] CurveCovariance covariance(const RowMatrixView<float>& curves, int lost = 1,
                                         BlockPrecision precision = BlockPrecision::single_precision,
                                         const Compute& compute = {});

namespace reference {
// Two passes in double.
[[nodiscard]] CurveCovariance covariance(const RowMatrixView<float>& curves, int lost = 1);
}  // namespace reference

}  // namespace kinespace
