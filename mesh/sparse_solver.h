// Sparse symmetric positive definite systems, factored once and solved for many right-hand sides, to the same bits on
// every machine: scalar factorisation (Eigen's simplicial LDL' with the AMD ordering), substitution in a written order.
#pragma once

#include <cstdint>
#include <vector>

#include "kinespace/mesh/laplacian.h"

namespace kinespace {

class SparseSolver {
 public:
  // Throws Error{machine} when the matrix is not positive definite to working precision.
  explicit SparseSolver(const SparseMatrix& matrix);

  [[nodiscard]] int size() const { return static_cast<int>(diagonal_.size()); }
  // Solves in place for `columns` right-hand sides, stored by rows: unknown i of system c is at x[i * columns + c].
  // Fast for 3 and for multiples of 8. `scratch` is resized and may be kept between calls.
  void solve(double* x, int columns, std::vector<double>& scratch) const;

 private:
  std::vector<std::int32_t> place_;  // of each unknown in the factor's order
  std::vector<std::int64_t> first_;  // columns of L below the diagonal
  std::vector<std::int32_t> row_;
  std::vector<double> value_;
  std::vector<double> diagonal_;
};

}  // namespace kinespace
