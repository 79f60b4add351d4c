// Internal: the moments of blocks of curves about a shift, and their form on a device.
#pragma once

#include "kinespace/kernels/covariance.h"

namespace kinespace::covariance_detail {

constexpr Eigen::Index kBlockCurves = 1024;

// Where moments are added; `scatter` to its lower half.
struct Moments {
  const Eigen::RowVectorXf& shift;
  Eigen::RowVectorXd& sum;
  RowMatrix<double>& scatter;
};

// Adds the moments of `count` curves, `stride` numbers apart, by blocks of kBlockCurves in their order.
void add_on_device(OpenClDevice& device, bool lanes, const float* curves, Eigen::Index stride, Eigen::Index count,
                   const Moments& moments);

}  // namespace kinespace::covariance_detail
