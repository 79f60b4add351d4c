// Local linear smoothing on regular grids: a line, a symmetric surface, and the ridge of a surface.
//
// Positions are fractions of the domain, so that n points lie at i / (n - 1) in [0, 1], and a bandwidth is a fraction
// of the domain too. Every estimate is the constant term of a least-squares fit around the wanted position, weighted by
// a kernel K; K's scale cancels. As PACE does it (Yao, Mueller, Wang 2005, eq. 4-6; the fdapace package), but on a
// regular grid the moments of the surface fit are sums of products of one-dimensional sums, so 100 x 100 points take
// about a millisecond instead of minutes. The plain C++ code uses one thread and no library.
//
// The forms with a Compute run on an OpenCL device where one was asked for, in double where it has that (results agree
// to 1e-11 of the largest), else in float (1e-4); "auto" keeps to the plain code unless a GPU pays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/kernels/device.h"

namespace kinespace {

enum class SmoothingKernel : std::uint8_t {
  epanechnikov,  // 3/4 (1 - u^2) for |u| < 1
  quartic,       // 15/16 (1 - u^2)^2 for |u| < 1
  gauss,         // the normal density: every point counts, so the cost no longer falls with the bandwidth
};

// K(u); zero outside the support.
[[nodiscard]] double kernel_value(SmoothingKernel kernel, double u);

// Fits {1, x - x0} to `values` (at i / (n - 1)) around each x0 of `at`. `weights`, one a value and >= 0, multiply the
// kernel's; empty means all 1. Throws Error{usage} when some x0 has fewer than two points with weight in its window.
[[nodiscard]] std::vector<double> local_linear_line(std::span<const double> values, std::span<const double> weights,
                                                    SmoothingKernel kernel, double bandwidth,
                                                    std::span<const double> at);
[[nodiscard]] std::vector<double> local_linear_line(std::span<const double> values, std::span<const double> weights,
                                                    SmoothingKernel kernel, double bandwidth,
                                                    std::span<const double> at, const Compute& compute);

enum class Diagonal : std::uint8_t {
  kept,
  left_out,  // a raw covariance carries the noise variance on its diagonal
};

// Fits {1, s - s0, t - t0} with the product kernel K(s - s0) K(t - t0) to a symmetric surface given on points x points,
// and gives it on out_points x out_points. The set-up depends only on the constructor's arguments, and is reused.
class LocalLinearSurface {
 public:
  // Throws Error{usage} when the bandwidth is not positive, or leaves too few points in some window.
  LocalLinearSurface(int points, int out_points, SmoothingKernel kernel, double bandwidth, Diagonal diagonal);

  // `surface`: points x points, symmetric. `out` is resized to out_points x out_points and is exactly symmetric.
  void smooth(const Eigen::MatrixXd& surface, Eigen::MatrixXd& out);
  void smooth(const Eigen::MatrixXd& surface, Eigen::MatrixXd& out, const Compute& compute);

  [[nodiscard]] int points() const noexcept { return points_; }
  [[nodiscard]] int out_points() const noexcept { return out_points_; }

 private:
  // Points first <= k < last have weight.
  struct Band {
    int first = 0;
    int last = 0;
  };
  using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct DiagonalMoments;

  void fill_weights(SmoothingKernel kernel, double bandwidth);
  [[nodiscard]] DiagonalMoments diagonal_moments() const;
  void solve_design(double bandwidth);

  int points_;
  int out_points_;
  Diagonal diagonal_;
  std::vector<Band> bands_;  // by output point
  Table weight_;             // K(u), out_points x points, u = (x - x0) / bandwidth
  Table weight_u_;           // K(u) u
  Table constant_share_;  // the estimate is constant_share * sum K K y + slope_share * sum K u K y + its mirror image
  Table slope_share_;
  Table source_, half_, half_turned_, sum_, sum_u_;  // work space of smooth()
};

// The value of the surface on its diagonal, at each (p, p), estimated from its off-diagonal points alone: the fit of
// {1, u^2, v - v0} in coordinates turned by 45 degrees, u = (s - t) / sqrt 2, v = (s + t) / sqrt 2, with the kernel
// K(u) K(v - v0). The covariance of the signal without its noise, up to the bias of the bandwidth.
// Throws Error{usage} when a window holds too few points.
[[nodiscard]] std::vector<double> rotated_quadratic_ridge(const Eigen::MatrixXd& symmetric, SmoothingKernel kernel,
                                                          double bandwidth, std::span<const double> at);

}  // namespace kinespace
