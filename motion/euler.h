// Euler angles of rotation channels, to and from unit quaternions.
//
// Channels apply left to right: R = R_i(a) R_j(b) R_k(c), the convention of BVH (motion/skeleton.h). No axis comes
// twice, so (i, j, k) is one of the six orders of X, Y, Z; where a joint has fewer than three rotation channels the
// missing axes follow in alphabetical order with angle zero.
//
// With half angles and parity e = +1 for cyclic orders (XYZ, YZX, ZXY), -1 for the others, and b' = e b, q_j' = e q_j:
//   w   = cos a cos b' cos c - sin a sin b' sin c     q_i = sin a cos b' cos c + cos a sin b' sin c
//   q_k = cos a cos b' sin c + sin a sin b' cos c     q_j' = cos a sin b' cos c - sin a cos b' sin c
// and backwards, well conditioned up to and at gimbal lock (E. Bernardes, S. Viollet, Quaternion to Euler angles
// conversion, PLOS ONE 17(11), 2022):
//   (a + c)/2 = atan2(q_i + q_k, w + q_j')    (a - c)/2 = atan2(q_i - q_k, w - q_j')
//   b' = 2 atan2(|q_i + q_k, w + q_j'|, |q_i - q_k, w - q_j'|) - 90 degrees
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "kinespace/motion/clip.h"

namespace kinespace {

struct EulerOrder {
  std::array<int, 3> axes = {2, 0, 1};  // 0, 1, 2 for X, Y, Z; a permutation
  int given = 3;                        // how many of them have a channel: 0..3
  [[nodiscard]] double parity() const { return (axes[1] - axes[0] + 3) % 3 == 1 ? 1 : -1; }
};

// Degrees, in channel order.
using EulerAngles = std::array<double, 3>;

// The order of the rotation channels among `channels`.
[[nodiscard]] EulerOrder euler_order(std::span<const Channel> channels);

// `count` frames of three angle columns in degrees, in channel order, to quaternions w x y z one after the other.
// Accurate to 4e-16 for angles up to 1e9 degrees; continuous angles give continuous quaternions.
void quaternions_from_euler(const EulerOrder& order, const double* a, const double* b, const double* c, int count,
                            double* wxyz);

// The angles of a rotation. Of the equivalent ones (whole turns; a + 180, 180 - b, c + 180) those nearest to `near`; at
// gimbal lock, where only a + c or a - c is defined, a stays as it is in `near`. Without `near`: |b| <= 90, a and c in
// [-180, 180], and a = 0 at gimbal lock.
[[nodiscard]] EulerAngles euler_angles(const EulerOrder& order, const Eigen::Quaterniond& q);
[[nodiscard]] EulerAngles euler_angles(const EulerOrder& order, const Eigen::Quaterniond& q, const EulerAngles& near);

// The channels a file needs to hold what the clip does at that joint: the joint's own, in their order, and
//  - all three positions when the joint moves (or rests) where its own position channels cannot put it,
//  - all three rotations when some rotation is not within 1e-7 rad of what its own rotation channels can express.
[[nodiscard]] std::vector<Channel> channels_to_write(const Clip& clip, int joint);

// Frames [first, first + count) of one joint's rotation as degrees of each rotation channel in `order`, into columns of
// `stride` numbers. `near` is the frame before and is left at the last frame; has_near tells whether it counts yet.
void euler_columns(const Clip& clip, int joint, const EulerOrder& order, int first, int count, double* columns,
                   int stride, EulerAngles& near, bool has_near);

}  // namespace kinespace
