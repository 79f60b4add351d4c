#include "kinespace/mesh/rigid.h"

#include <cmath>

#include "kinespace/mesh/detail/rotation_fit.h"

namespace kinespace {
namespace {

Eigen::Vector3d centroid(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    for (int c = 0; c < 3; ++c) sum[c] += points(v, c);
  }
  return sum / static_cast<double>(points.rows());
}

}  // namespace

Points RigidMotion::apply(const Points& y) const {
  Points out(y.rows(), 3);
  for (Eigen::Index v = 0; v < y.rows(); ++v) {
    for (int c = 0; c < 3; ++c) {
      out(v, c) = rotation(c, 0) * y(v, 0) + rotation(c, 1) * y(v, 1) + rotation(c, 2) * y(v, 2) + translation[c];
    }
  }
  return out;
}

Points RigidMotion::undo(const Points& x) const {
  Points out(x.rows(), 3);
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const double a = x(v, 0) - translation[0], b = x(v, 1) - translation[1], d = x(v, 2) - translation[2];
    for (int c = 0; c < 3; ++c) out(v, c) = rotation(0, c) * a + rotation(1, c) * b + rotation(2, c) * d;
  }
  return out;
}

RigidMotion rigid_motion(const Points& from, const Points& to) {
  const Eigen::Vector3d p = centroid(from), q = centroid(to);
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (Eigen::Index v = 0; v < from.rows(); ++v) {
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) m(a, b) += (to(v, a) - q[a]) * (from(v, b) - p[b]);
    }
  }
  RigidMotion out;
  out.rotation = nearest_rotation(m);
  for (int c = 0; c < 3; ++c) {
    out.translation[c] = q[c] - (out.rotation(c, 0) * p[0] + out.rotation(c, 1) * p[1] + out.rotation(c, 2) * p[2]);
  }
  return out;
}

std::vector<RigidMotion> rigid_motions(const MeshSequence& mesh, int reference) {
  std::vector<RigidMotion> out(static_cast<std::size_t>(mesh.frames));
  const Points still = frame_points(mesh, reference);
  for (int f = 0; f < mesh.frames; ++f) {
    if (f != reference) out[static_cast<std::size_t>(f)] = rigid_motion(still, frame_points(mesh, f));
  }
  return out;
}

Eigen::Vector3d rotation_numbers(const Eigen::Matrix3d& r) {
  // The largest of the four components of the quaternion is found from the diagonal, the others from it.
  const std::array<double, 4> squares = {1 + r(0, 0) + r(1, 1) + r(2, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2),
                                         1 - r(0, 0) + r(1, 1) - r(2, 2), 1 - r(0, 0) - r(1, 1) + r(2, 2)};
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i) largest = squares[i] > squares[largest] ? i : largest;
  const double twice = std::sqrt(squares[largest]);
  const double wx = (r(2, 1) - r(1, 2)) / (2 * twice), wy = (r(0, 2) - r(2, 0)) / (2 * twice),
               wz = (r(1, 0) - r(0, 1)) / (2 * twice), xy = (r(0, 1) + r(1, 0)) / (2 * twice),
               xz = (r(0, 2) + r(2, 0)) / (2 * twice), yz = (r(1, 2) + r(2, 1)) / (2 * twice);
  double w = 0;
  Eigen::Vector3d out;
  switch (largest) {
    case 0:
      w = twice / 2;
      out = {wx, wy, wz};
      break;
    case 1:
      w = wx;
      out = {twice / 2, xy, xz};
      break;
    case 2:
      w = wy;
      out = {xy, twice / 2, yz};
      break;
    default:
      w = wz;
      out = {xz, yz, twice / 2};
      break;
  }
  return w < 0 ? Eigen::Vector3d(-out) : out;
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& numbers) {
  double x = numbers[0], y = numbers[1], z = numbers[2];
  double length = x * x + y * y + z * z;
  if (length > 1) {
    const double root = std::sqrt(length);
    x /= root;
    y /= root;
    z /= root;
    length = 1;
  }
  const double w = std::sqrt(1 - length);
  Eigen::Matrix3d out;
  out << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),     //
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  return out;
}

}  // namespace kinespace
