#include "kinespace/mesh/detail/rotation_fit.h"

#include <array>
#include <cmath>

namespace kinespace {
namespace {

using Symmetric = std::array<std::array<double, 4>, 4>;

// Horn's matrix of S = m': its top eigenvector is the quaternion (w, x, y, z).
Symmetric horn_matrix(const Eigen::Matrix3d& m) {
  const double xx = m(0, 0), xy = m(1, 0), xz = m(2, 0);
  const double yx = m(0, 1), yy = m(1, 1), yz = m(2, 1);
  const double zx = m(0, 2), zy = m(1, 2), zz = m(2, 2);
  return {{{xx + yy + zz, yz - zy, zx - xz, xy - yx},
           {yz - zy, xx - yy - zz, xy + yx, zx + xz},
           {zx - xz, xy + yx, yy - xx - zz, yz + zy},
           {xy - yx, zx + xz, yz + zy, zz - xx - yy}}};
}

double determinant(const Eigen::Matrix3d& m) {
  return m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
         m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
}

double cofactor_norm(const Eigen::Matrix3d& m) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      const double cofactor = m(a, c) * m(b, d) - m(a, d) * m(b, c);
      sum += cofactor * cofactor;
    }
  }
  return sum;
}

// The largest root of x^4 - 2 x^2 + c1 x + c0, for a matrix of Frobenius norm 1: not above sqrt 3, and convex from
// there down to it, so that Newton's steps only go down and cannot pass it.
double largest_root(double c1, double c0) {
  constexpr int most_steps = 60;  // a double root halves the distance each time
  double x = 1.7320508075688774;
  for (int step = 0; step < most_steps; ++step) {
    const double value = ((x * x - 2) * x + c1) * x + c0;
    const double slope = (4 * x * x - 4) * x + c1;
    if (!(value > 0) || !(slope > 0)) break;
    const double next = x - value / slope;
    if (x - next < 1e-12) return next;
    x = next;
  }
  return x;
}

// Cofactors of row `r` of a 4 x 4 matrix.
std::array<double, 4> cofactors(const Symmetric& a, std::size_t r) {
  const auto& p = a[(r + 1) % 4];
  const auto& q = a[(r + 2) % 4];
  const auto& s = a[(r + 3) % 4];
  const double sign = r % 2 == 0 ? 1 : -1;
  std::array<double, 4> out{};
  for (std::size_t c = 0; c < 4; ++c) {
    const std::size_t i = (c + 1) % 4, j = (c + 2) % 4, k = (c + 3) % 4;
    const double minor =
        p[i] * (q[j] * s[k] - q[k] * s[j]) - p[j] * (q[i] * s[k] - q[k] * s[i]) + p[k] * (q[i] * s[j] - q[j] * s[i]);
    // Cyclic orders of four are odd permutations for odd shifts, of the rows and of the columns.
    out[c] = c % 2 == 0 ? sign * minor : -sign * minor;
  }
  return out;
}

}  // namespace

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  double norm = 0;
  for (int i = 0; i < 9; ++i) norm += m.data()[i] * m.data()[i];
  norm = std::sqrt(norm);
  if (!(norm > 1e-150)) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d unit;
  for (int i = 0; i < 9; ++i) unit.data()[i] = m.data()[i] / norm;
  const double root = largest_root(-8 * determinant(unit), 1 - 4 * cofactor_norm(unit));
  // Beyond the root the adjugate holds the top eigenvector however many there are of it.
  constexpr double beyond = 1e-10;
  Symmetric shifted = horn_matrix(unit);
  for (std::size_t i = 0; i < 4; ++i) shifted[i][i] -= root + beyond;
  std::array<double, 4> q{};
  double longest = 0;
  for (std::size_t r = 0; r < 4; ++r) {
    const auto row = cofactors(shifted, r);
    const double length = row[0] * row[0] + row[1] * row[1] + row[2] * row[2] + row[3] * row[3];
    if (length > longest) {
      longest = length;
      q = row;
    }
  }
  if (!(longest > 0)) return Eigen::Matrix3d::Identity();
  const double s = 2 / longest;
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  Eigen::Matrix3d out;
  out << 1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),  //
      s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),     //
      s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y);
  return out;
}

}  // namespace kinespace
