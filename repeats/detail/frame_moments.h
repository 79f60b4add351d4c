// Sums over frames of a table: count, mean and covariance, in double precision, in a fixed order whatever the number of
// threads. Private to this folder.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "kinespace/repeats/frame_table.h"

namespace kinespace {

struct FrameMoments {
  std::int64_t count = 0;
  Eigen::VectorXd mean;        // [dimension]
  Eigen::MatrixXd covariance;  // [dimension][dimension], divided by count
};

[[nodiscard]] FrameMoments frame_moments(const FrameTable& table, std::span<const FrameSpan> ranges);

// Eigenvalues of a covariance, descending, none negative, and the vectors as columns; of each vector the number of
// largest magnitude is positive.
struct PrincipalAxes {
  Eigen::VectorXd variances;
  Eigen::MatrixXd axes;
};
[[nodiscard]] PrincipalAxes principal_axes(const Eigen::MatrixXd& covariance);

// The frames of ranges as a matrix: [dimension][frame].
using FrameMatrix = Eigen::Map<const Eigen::MatrixXf>;
[[nodiscard]] inline FrameMatrix frame_matrix(const FrameTable& table, FrameSpan range) {
  return {table.values.data() + range.first * table.dimensions, table.dimensions, range.frames()};
}

// The same frames in the space of their largest principal components, `dimensions` of them at most.
[[nodiscard]] FrameTable reduced_table(const FrameTable& table, int dimensions);

}  // namespace kinespace
