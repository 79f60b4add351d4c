// Internal: the factors of the table of distances, and its form on a device.
#pragma once

#include "kinespace/kernels/keyframe_distance.h"

namespace kinespace::keyframe_detail {

struct Factors {
  RowMatrix<float> a;  // less the mean row of b
  RowMatrix<float> b;
  Eigen::VectorXf a_norms;  // squared
  Eigen::VectorXf b_norms;
};

// Neither factor is empty.
[[nodiscard]] RowMatrix<float> on_device(OpenClDevice& device, bool lanes, const Factors& factors, DistanceKind kind);

}  // namespace kinespace::keyframe_detail
