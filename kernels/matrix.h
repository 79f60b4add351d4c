// Row-major matrices: a row is a curve, a frame's features, a vector of scores; one row after another in memory.
#pragma once

#include <Eigen/Core>

namespace kinespace {

template <typename T>
using RowMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A view of rows, with any distance from row to row; takes a RowMatrix, an Eigen::Map of one, or a block of either.
template <typename T>
using RowMatrixView = Eigen::Ref<const RowMatrix<T>, 0, Eigen::OuterStride<>>;

}  // namespace kinespace
