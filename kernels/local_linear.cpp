#include "kinespace/kernels/local_linear.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// Below this share of the product of its diagonal, the determinant of a design is rounding: the points in the window
// lie on one line, or are one point.
constexpr double singular_share = 1e-10;

[[noreturn]] void throw_too_narrow(double bandwidth, std::size_t points) {
  throw Error(ErrorKind::usage,
              {.found = "smoothing bandwidth " + std::to_string(bandwidth) + " of the domain on " +
                        std::to_string(points) + " points",
               .expected = "at least two grid steps in every window",
               .remedy = "use a bandwidth of " +
                         std::to_string(2.0 / static_cast<double>(std::max<std::size_t>(points, 3) - 1)) +
                         " or more, or do not smooth"});
}

void require_bandwidth(double bandwidth, std::size_t points) {
  if (!(bandwidth > 0) || !std::isfinite(bandwidth) || points < 2) throw_too_narrow(bandwidth, points);
}

double position(Eigen::Index i, Eigen::Index points) {
  return points < 2 ? 0 : static_cast<double>(i) / static_cast<double>(points - 1);
}

// The symmetric 3 x 3 normal equations of a fit; only the constant term is wanted, so Cramer's rule on its first row.
struct Design {
  double s00 = 0, s10 = 0, s01 = 0, s20 = 0, s11 = 0, s02 = 0;

  struct Shares {
    double constant, first, second;  // the estimate is their dot product with the right-hand side
    bool singular;
  };
  [[nodiscard]] Shares shares() const {
    const double a = s20 * s02 - s11 * s11;
    const double b = s11 * s01 - s10 * s02;
    const double c = s10 * s11 - s20 * s01;
    const double det = s00 * a + s10 * b + s01 * c;
    return {a / det, b / det, c / det, !(det > singular_share * s00 * s20 * s02)};
  }
};

}  // namespace

double kernel_value(SmoothingKernel kernel, double u) {
  // A point on the window's edge has no weight, however its distance was rounded.
  constexpr double rounding = 1e-12;
  const double inside = 1 - u * u;
  switch (kernel) {
    case SmoothingKernel::epanechnikov:
      return inside > rounding ? 0.75 * inside : 0;
    case SmoothingKernel::quartic:
      return inside > rounding ? 15.0 / 16.0 * inside * inside : 0;
    case SmoothingKernel::gauss:
      return std::exp(-0.5 * u * u) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  }
  return 0;
}

std::vector<double> local_linear_line(std::span<const double> values, std::span<const double> weights,
                                      SmoothingKernel kernel, double bandwidth, std::span<const double> at) {
  require_bandwidth(bandwidth, values.size());
  const auto n = static_cast<Eigen::Index>(values.size());
  std::vector<double> out;
  out.reserve(at.size());
  for (const double x0 : at) {
    double s0 = 0, s1 = 0, s2 = 0, r0 = 0, r1 = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double u = (position(k, n) - x0) / bandwidth;
      double w = kernel_value(kernel, u);
      if (w == 0) continue;
      if (!weights.empty()) w *= weights[static_cast<std::size_t>(k)];
      s0 += w;
      s1 += w * u;
      s2 += w * u * u;
      r0 += w * values[static_cast<std::size_t>(k)];
      r1 += w * u * values[static_cast<std::size_t>(k)];
    }
    const double det = s0 * s2 - s1 * s1;
    if (!(det > singular_share * s0 * s2)) throw_too_narrow(bandwidth, values.size());
    out.push_back((s2 * r0 - s1 * r1) / det);
  }
  return out;
}

// Sums over the diagonal's points k of K(x_k - s) u^p K(x_k - t) u^q, to be taken off the separable moments.
struct LocalLinearSurface::DiagonalMoments {
  Table m00, m10, m20, m11;
};

LocalLinearSurface::LocalLinearSurface(int points, int out_points, SmoothingKernel kernel, double bandwidth,
                                       Diagonal diagonal)
    : points_(points), out_points_(out_points), diagonal_(diagonal) {
  require_bandwidth(bandwidth, static_cast<std::size_t>(std::max(points, 0)));
  if (out_points < 1) throw_too_narrow(bandwidth, static_cast<std::size_t>(points));
  fill_weights(kernel, bandwidth);
  solve_design(bandwidth);
}

void LocalLinearSurface::fill_weights(SmoothingKernel kernel, double bandwidth) {
  bands_.resize(static_cast<std::size_t>(out_points_));
  weight_.setZero(out_points_, points_);
  weight_u_.setZero(out_points_, points_);
  for (int i = 0; i < out_points_; ++i) {
    Band& band = bands_[static_cast<std::size_t>(i)];
    band = {.first = points_, .last = 0};
    for (int k = 0; k < points_; ++k) {
      const double u = (position(k, points_) - position(i, out_points_)) / bandwidth;
      const double w = kernel_value(kernel, u);
      if (w == 0) continue;
      band.first = std::min(band.first, k);
      band.last = k + 1;
      weight_(i, k) = w;
      weight_u_(i, k) = w * u;
    }
    if (band.last <= band.first) throw_too_narrow(bandwidth, static_cast<std::size_t>(points_));
  }
}

LocalLinearSurface::DiagonalMoments LocalLinearSurface::diagonal_moments() const {
  const Table zero = Table::Zero(out_points_, out_points_);
  DiagonalMoments m{zero, zero, zero, zero};
  if (diagonal_ == Diagonal::kept) return m;
  Table weight_uu = weight_u_.cwiseProduct(weight_u_);
  for (int i = 0; i < out_points_; ++i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    for (int k = band.first; k < band.last; ++k) weight_uu(i, k) /= weight_(i, k);
  }
  for (int i = 0; i < out_points_; ++i) {
    for (int j = 0; j < out_points_; ++j) {
      const Band& a = bands_[static_cast<std::size_t>(i)];
      const Band& b = bands_[static_cast<std::size_t>(j)];
      for (int k = std::max(a.first, b.first); k < std::min(a.last, b.last); ++k) {
        const double other = weight_(j, k);
        m.m00(i, j) += weight_(i, k) * other;
        m.m10(i, j) += weight_u_(i, k) * other;
        m.m20(i, j) += weight_uu(i, k) * other;
        m.m11(i, j) += weight_u_(i, k) * weight_u_(j, k);
      }
    }
  }
  return m;
}

void LocalLinearSurface::solve_design(double bandwidth) {
  const DiagonalMoments off = diagonal_moments();
  Eigen::ArrayXd s0(out_points_), s1(out_points_), s2(out_points_);
  for (int i = 0; i < out_points_; ++i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    const int count = band.last - band.first;
    const auto w = weight_.row(i).segment(band.first, count).array();
    const auto wu = weight_u_.row(i).segment(band.first, count).array();
    s0[i] = w.sum();
    s1[i] = wu.sum();
    s2[i] = (wu * wu / w).sum();
  }
  constant_share_.resize(out_points_, out_points_);
  slope_share_.resize(out_points_, out_points_);
  for (int i = 0; i < out_points_; ++i) {
    for (int j = 0; j < out_points_; ++j) {
      const Design design{.s00 = s0[i] * s0[j] - off.m00(i, j),
                          .s10 = s1[i] * s0[j] - off.m10(i, j),
                          .s01 = s0[i] * s1[j] - off.m10(j, i),
                          .s20 = s2[i] * s0[j] - off.m20(i, j),
                          .s11 = s1[i] * s1[j] - off.m11(i, j),
                          .s02 = s0[i] * s2[j] - off.m20(j, i)};
      const Design::Shares shares = design.shares();
      if (shares.singular) throw_too_narrow(bandwidth, static_cast<std::size_t>(points_));
      constant_share_(i, j) = shares.constant;
      slope_share_(i, j) = shares.first;  // the second is the first's mirror image
    }
  }
}

void LocalLinearSurface::smooth(const Eigen::MatrixXd& surface, Eigen::MatrixXd& out) {
  source_ = surface;
  if (diagonal_ == Diagonal::left_out) source_.diagonal().setZero();
  half_.resize(out_points_, points_);
  for (int i = 0; i < out_points_; ++i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    half_.row(i) = weight_(i, band.first) * source_.row(band.first);
    for (int k = band.first + 1; k < band.last; ++k) half_.row(i) += weight_(i, k) * source_.row(k);
  }
  half_turned_ = half_.transpose();
  sum_.setZero(out_points_, out_points_);
  sum_u_.setZero(out_points_, out_points_);
  for (int i = 0; i < out_points_; ++i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    for (int k = band.first; k < band.last; ++k) {
      sum_.row(i) += weight_(i, k) * half_turned_.row(k);
      sum_u_.row(i) += weight_u_(i, k) * half_turned_.row(k);
    }
  }
  out.resize(out_points_, out_points_);
  for (int i = 0; i < out_points_; ++i) {
    for (int j = 0; j <= i; ++j) {
      out(i, j) = constant_share_(i, j) * 0.5 * (sum_(i, j) + sum_(j, i)) + slope_share_(i, j) * sum_u_(i, j) +
                  slope_share_(j, i) * sum_u_(j, i);
      out(j, i) = out(i, j);
    }
  }
}

std::vector<double> rotated_quadratic_ridge(const Eigen::MatrixXd& symmetric, SmoothingKernel kernel, double bandwidth,
                                            std::span<const double> at) {
  const Eigen::Index n = symmetric.rows();
  require_bandwidth(bandwidth, static_cast<std::size_t>(n));
  const double turned = bandwidth * std::numbers::sqrt2;  // the bandwidth in s - t and s + t

  // Across the ridge first: for each anti-diagonal i + j the sums over u, which hold for every place along the ridge.
  struct Across {
    double n0 = 0, n1 = 0, n2 = 0, y0 = 0, y1 = 0;  // sums of K, K u^2, K u^4, K y, K u^2 y
  };
  std::vector<double> across_weight(static_cast<std::size_t>(n));
  for (Eigen::Index d = 0; d < n; ++d) {
    across_weight[static_cast<std::size_t>(d)] = kernel_value(kernel, position(d, n) / turned);
  }
  std::vector<Across> lines(static_cast<std::size_t>(2 * n - 1));
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j + 1; i < n; ++i) {
      const double w = across_weight[static_cast<std::size_t>(i - j)];
      if (w == 0) break;
      const double u = position(i - j, n) / turned;
      Across& line = lines[static_cast<std::size_t>(i + j)];
      line.n0 += w;
      line.n1 += w * u * u;
      line.n2 += w * u * u * u * u;
      line.y0 += w * symmetric(i, j);
      line.y1 += w * u * u * symmetric(i, j);
    }
  }

  std::vector<double> out;
  out.reserve(at.size());
  for (const double p : at) {
    Design design;
    double r0 = 0, r1 = 0, r2 = 0;
    for (std::size_t s = 0; s < lines.size(); ++s) {
      const double v = (position(static_cast<Eigen::Index>(s), n) - 2 * p) / turned;
      const double w = kernel_value(kernel, v);
      if (w == 0) continue;
      const Across& line = lines[s];
      design.s00 += w * line.n0;
      design.s10 += w * line.n1;
      design.s01 += w * v * line.n0;
      design.s20 += w * line.n2;
      design.s11 += w * v * line.n1;
      design.s02 += w * v * v * line.n0;
      r0 += w * line.y0;
      r1 += w * line.y1;
      r2 += w * v * line.y0;
    }
    const Design::Shares shares = design.shares();
    if (shares.singular) throw_too_narrow(bandwidth, static_cast<std::size_t>(n));
    out.push_back(shares.constant * r0 + shares.first * r1 + shares.second * r2);
  }
  return out;
}

}  // namespace kinespace
