// The table of keyframe distances between two lists of frames (yoo2019, eq. 12).
//
// All terms of eq. 12 are squared distances between vectors, so with feature rows in which each part is multiplied by
// the root of its weight the keyframe distance is Euclidean:
//
//   d(i, j)^2 = |a_i|^2 + |b_j|^2 - 2 a_i . b_j,   clamped at 0
//
// which is one matrix product. The mean row of b is taken from both lists first. Rounding is that of float relative to
// the norms that remain: squared distances are exact to about 1e-6 (|a_i|^2 + |b_j|^2), so equal rows need not give
// exactly 0; where that matters (short lists of finalists, warping), take dtw() or sum the differences.
#pragma once

#include <cstdint>

#include "kinespace/kernels/device.h"
#include "kinespace/kernels/matrix.h"

namespace kinespace {

enum class DistanceKind : std::uint8_t { rooted, squared };

// a: n x d, b: m x d; the result is n x m. Throws Error{usage} when the numbers of features differ.
[[nodiscard]] RowMatrix<float> keyframe_distances(const RowMatrixView<float>& a, const RowMatrixView<float>& b,
                                                  DistanceKind kind = DistanceKind::rooted,
                                                  const Compute& compute = {});

namespace reference {
// The same from sums of squared differences in double.
[[nodiscard]] RowMatrix<float> keyframe_distances(const RowMatrixView<float>& a, const RowMatrixView<float>& b,
                                                  DistanceKind kind = DistanceKind::rooted);
}  // namespace reference

}  // namespace kinespace
