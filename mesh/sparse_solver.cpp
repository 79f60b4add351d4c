#include "kinespace/mesh/sparse_solver.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "kinespace/base/error.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

struct Factor {
  std::size_t size;
  const std::int64_t* first;
  const std::int32_t* row;
  const double* value;
  const double* diagonal;
};

template <int Columns>
[[gnu::always_inline]] inline void substitute(const Factor& f, double* y, std::size_t stride) {
  double x[Columns];
  for (std::size_t j = 0; j < f.size; ++j) {
    for (int c = 0; c < Columns; ++c) x[c] = y[j * stride + static_cast<std::size_t>(c)];
    for (std::int64_t at = f.first[j]; at < f.first[j + 1]; ++at) {
      double* const below = y + static_cast<std::size_t>(f.row[at]) * stride;
      for (int c = 0; c < Columns; ++c) below[c] -= f.value[at] * x[c];
    }
  }
  for (std::size_t j = f.size; j-- > 0;) {
    for (int c = 0; c < Columns; ++c) x[c] = y[j * stride + static_cast<std::size_t>(c)] / f.diagonal[j];
    for (std::int64_t at = f.first[j]; at < f.first[j + 1]; ++at) {
      const double* const below = y + static_cast<std::size_t>(f.row[at]) * stride;
      for (int c = 0; c < Columns; ++c) x[c] -= f.value[at] * below[c];
    }
    for (int c = 0; c < Columns; ++c) y[j * stride + static_cast<std::size_t>(c)] = x[c];
  }
}

KINESPACE_VECTOR_CLONES
void substitute_all(const Factor& f, double* y, int columns) {
  const auto stride = static_cast<std::size_t>(columns);
  int c = 0;
  for (; c + 8 <= columns; c += 8) substitute<8>(f, y + c, stride);
  for (; c + 3 <= columns; c += 3) substitute<3>(f, y + c, stride);
  for (; c < columns; ++c) substitute<1>(f, y + c, stride);
}

}  // namespace

SparseSolver::SparseSolver(const SparseMatrix& matrix) {
  const Eigen::SimplicialLDLT<SparseMatrix> factored(matrix);
  const bool positive = factored.info() == Eigen::Success && (factored.vectorD().array() > 0).all();
  if (!positive) {
    throw Error(ErrorKind::machine, {.found = "a linear system of the mesh that is not positive definite"});
  }
  const auto& order = factored.permutationP().indices();
  place_.assign(order.data(), order.data() + order.size());
  const Eigen::VectorXd d = factored.vectorD();
  diagonal_.assign(d.data(), d.data() + d.size());
  const SparseMatrix lower = factored.matrixL();
  first_.assign(1, 0);
  for (Eigen::Index j = 0; j < lower.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(lower, j); it; ++it) {
      if (it.row() == j) continue;
      row_.push_back(static_cast<std::int32_t>(it.row()));
      value_.push_back(it.value());
    }
    first_.push_back(static_cast<std::int64_t>(row_.size()));
  }
}

void SparseSolver::solve(double* x, int columns, std::vector<double>& scratch) const {
  const auto stride = static_cast<std::size_t>(columns);
  scratch.resize(place_.size() * stride);
  for (std::size_t i = 0; i < place_.size(); ++i) {
    std::copy_n(x + i * stride, stride, scratch.data() + static_cast<std::size_t>(place_[i]) * stride);
  }
  substitute_all({diagonal_.size(), first_.data(), row_.data(), value_.data(), diagonal_.data()}, scratch.data(),
                 columns);
  for (std::size_t i = 0; i < place_.size(); ++i) {
    std::copy_n(scratch.data() + static_cast<std::size_t>(place_[i]) * stride, stride, x + i * stride);
  }
}

}  // namespace kinespace
