// The rotation nearest to a 3 x 3 matrix.
#pragma once

#include <Eigen/Core>

namespace kinespace {

// The proper rotation R that maximises trace(R' m): for m = sum of w_i q_i p_i' the one that minimises
// sum of w_i |R p_i - q_i|^2, also where the best orthogonal matrix would be a reflection. The identity for m = 0; one
// of the best where there are several (m of rank one, say).
//
// Computed as the quaternion that is the top eigenvector of horn's 4 x 4 matrix (horn 1987), its eigenvalue by Newton's
// method on the characteristic polynomial from above (theobald 2005), with sums, products, quotients and roots only,
// which every machine rounds alike: the same bits everywhere. Exact to 1e-9 where the rotation is well determined;
// matrices smaller than 1e-150 count as zero.
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace kinespace
