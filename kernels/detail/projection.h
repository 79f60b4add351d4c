// Internal: the one product behind projection and reconstruction, on a device.
#pragma once

#include "kinespace/kernels/projection.h"

namespace kinespace::projection_detail {

// (a - shift) b + offset; no size is 0.
[[nodiscard]] RowMatrix<float> on_device(OpenClDevice& device, bool lanes, const RowMatrixView<float>& a,
                                         const Eigen::VectorXf& shift, const RowMatrix<float>& b,
                                         const Eigen::VectorXf& offset);

}  // namespace kinespace::projection_detail
