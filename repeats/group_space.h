// The space of a behaviour group: the mean posture and the principal components of its frames (lin2011 section 4.1).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/repeats/frame_table.h"

namespace kinespace {

struct GroupSpace {
  Eigen::VectorXd mean;       // [dimension]
  Eigen::MatrixXd axes;       // [dimension][axis], orthonormal, by descending variance; of each, the number of largest
                              // magnitude (the first of them) is positive
  Eigen::VectorXd variances;  // [axis], per frame, in squared units of the table
  double total_variance = 0;  // of all dimensions

  [[nodiscard]] int axis_count() const { return static_cast<int>(axes.cols()); }
  [[nodiscard]] int dimensions() const { return static_cast<int>(mean.size()); }

  // Coefficients of frames, [axis][frame], in the order of the ranges.
  [[nodiscard]] Eigen::MatrixXf project(const FrameTable& table, std::span<const FrameSpan> ranges) const;
  // mean + axes * coefficients: [dimension][frame].
  [[nodiscard]] Eigen::MatrixXd reconstruct(const Eigen::MatrixXd& coefficients) const;
};

// How many axes a space keeps.
struct AxisChoice {
  double variance = 0.95;               // > 0 to 1: the fewest axes that keep this share of the variance, at least one
  std::optional<int> axes = {};         // or this many (at most the dimensions), whatever they keep
  std::optional<double> residual = {};  // or the fewest that leave at most this variance per frame (squared units)
};

// The space of the frames of the ranges; the same whatever the number of threads. Frames without any variance give one
// axis. Throws Error{usage} when there is no frame.
[[nodiscard]] GroupSpace fit_group_space(const FrameTable& table, std::span<const FrameSpan> ranges,
                                         const AxisChoice& choice = {});

}  // namespace kinespace
