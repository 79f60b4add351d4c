// Functional principal component analysis of curves sampled on one regular grid.
//
// n curves y_i of T points over a domain (start, end) give a mean mu, orthonormal functions phi_j and their variances
// lambda_j, so that y_i is near mu + sum_j xi_ij phi_j with as few functions as any basis can need (yoo2019,
// section 4.1; Yao, Mueller, Wang 2005 for the smoothed covariance, the noise variance and the conditional scores).
//
// Integrals are trapezoid sums with weights w (h inside, h / 2 at the ends; a grid of one point has weight 1).
//
//   consistent  the default: phi = W^-1/2 v for eigenvectors v of W^1/2 C W^1/2. The functions are orthonormal in the
//               inner product that the integration scores use, so scores and reconstruction are exact inverses on their
//               span, and Parseval holds: the squared L2 error of leaving functions out is the sum of their squared
//               scores.
//   pace        what the PACE package computes (fdapace 0.6), for comparison: v of plain C, lambda = h d,
//               phi = v / sqrt(trapz v^2). Its functions are orthogonal in the plain dot product but scored in the
//               trapezoid one.
//
// Signs:
//
//   consistent  the integral of phi(u) exp(-u), u in [0, 1], is positive (a weight that no sine or cosine of a whole
//               number of half-periods is orthogonal to).
//   pace        sum_j phi(t_j) mu(t_j) >= 0, mu interpolated linearly to the work grid, and the consistent rule where
//               that sum is 0.
//
// The result is the same for the same curves whatever the number of threads.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "kinespace/fpca/curve_moments.h"
#include "kinespace/kernels/local_linear.h"

namespace kinespace {

// The interval the grid covers, both ends included, in the unit the scores and eigenvalues shall have (seconds, or 1).
struct Domain {
  double start = 0;
  double end = 1;
  [[nodiscard]] double length() const { return end - start; }
};

enum class FpcaMode : std::uint8_t { consistent, pace };
enum class MeanEstimate : std::uint8_t {
  cross_sectional,  // the mean of the curves at each point
  smooth,           // a local linear fit of that
  spline,  // the smoothing spline through that which leaves as much as its noise: that of the curves by their second
           // differences, over their number (numerics/spline.h); of clean or of many curves it is their mean
};
enum class ScoreKind : std::uint8_t {
  integration,  // integral of (y - mu) phi: exact on the span of the functions
  conditional,  // the expectation given the curve, its noise and the eigenvalues: shrinks what may be noise
};

struct FpcaOptions {
  FpcaMode mode = FpcaMode::consistent;
  MeanEstimate mean = MeanEstimate::cross_sectional;
  // Smooths the covariance, raw (divided by n) about the mean above; else it is the sample covariance (n - 1). Clean
  // motion capture needs no smoothing: what it takes away there is signal.
  bool smooth_covariance = false;
  // Estimates the variance of white noise and keeps it out of the functions. Smoothed: from the diagonal against the
  // ridge fitted to its neighbours, over the middle half of the domain. Not smoothed: mean squared second difference
  // / 6.
  bool estimate_noise = false;
  SmoothingKernel kernel = SmoothingKernel::epanechnikov;
  double mean_bandwidth = 0.05;        // of the domain's length, in (0, 10]; a bit more than a grid step at least
  double covariance_bandwidth = 0.10;  // the same
  // How many functions: the fewest whose eigenvalues reach this share of all variance, in (0, 1] ...
  double variance_share = 0.9999;
  // ... or this many, >= 0; fewer when fewer eigenvalues are positive.
  std::optional<int> count;
  ScoreKind scores = ScoreKind::integration;
  // Integration scores times lambda / (lambda + L sigma^2 / T); needs estimate_noise.
  bool shrink = false;
  // Conditional scores with a noise variance found from their residuals instead of sigma^2 (the package's rho,
  // 'trunc').
  bool truncate_noise = false;
  // Points of the grid that covariance and functions live on; 0: the curves' own T. Only `pace` can have another.
  int work_points = 0;
  // Positive eigenpairs kept at all, >= 0: the fitted covariance behind the conditional scores is made of them, and in
  // `pace` shares count only them. 0: in `pace` 20 when smoothed, else T - 2 (as the package); in `consistent` 20 for
  // the fitted covariance. At least `count`.
  int max_functions = 0;

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

struct FunctionalPca {
  FpcaOptions options;
  Domain domain;
  std::int64_t curve_count = 0;

  // On the work grid of R points.
  Eigen::VectorXd grid;
  Eigen::VectorXd mean;
  Eigen::MatrixXd functions;          // R x k
  Eigen::VectorXd eigenvalues;        // k, descending, > 0; value^2 * domain unit: the variances of the scores
  Eigen::VectorXd all_eigenvalues;    // R, descending, those below zero too
  Eigen::VectorXd cumulative_shares;  // k: share of variance that the first j + 1 functions carry
  Eigen::MatrixXd covariance;         // R x R: what was decomposed (smoothed, without noise, as asked)

  std::optional<double> noise_variance;  // sigma^2, if estimated
  double score_noise = 0;                // what the conditional scores used
  Eigen::MatrixX3d noise_diagonal;  // smoothed: t, diagonal with noise, without; on the middle half of the work grid

  // On the T points of the curves.
  Eigen::VectorXd weights;  // of the trapezoid rule
  Eigen::VectorXd observed_mean;
  Eigen::MatrixXd observed_functions;    // T x k
  CurveMatrix integration;               // k x T: integration scores are this times (y - mean)
  CurveMatrix conditional;               // k x T, if options.scores is conditional; else empty
  Eigen::MatrixXd posterior_covariance;  // k x k, of the conditional scores, the same for every curve

  [[nodiscard]] int points() const { return static_cast<int>(observed_mean.size()); }
  [[nodiscard]] int count() const { return static_cast<int>(eigenvalues.size()); }

  // n x k, of the kind in options, or the given one. Throws Error{usage} for curves of another length and for
  // conditional scores that were not fitted, Error{bad_input} for curves with values that are not finite.
  [[nodiscard]] CurveMatrix scores(const CurveView& samples) const { return scores(samples, options.scores); }
  [[nodiscard]] CurveMatrix scores(const CurveView& samples, ScoreKind kind) const;
  // mu + sum_j xi_j phi_j on the curves' points, from the first m <= k scores of each row: n x m in, n x T out.
  [[nodiscard]] CurveMatrix reconstruct(const CurveView& scores) const;
};

// Fits again and again curves of the same length with the same options, reusing set-up and memory.
class FunctionalPcaWorkspace {
 public:
  // Throws Error{usage} for bad options, points < 1, an empty domain, and bandwidths too narrow for the grid.
  FunctionalPcaWorkspace(int points, const FpcaOptions& options, Domain domain = {});
  ~FunctionalPcaWorkspace();
  FunctionalPcaWorkspace(FunctionalPcaWorkspace&&) noexcept;
  FunctionalPcaWorkspace& operator=(FunctionalPcaWorkspace&&) noexcept;
  FunctionalPcaWorkspace(const FunctionalPcaWorkspace&) = delete;
  FunctionalPcaWorkspace& operator=(const FunctionalPcaWorkspace&) = delete;

  // One curve a row. Throws Error{bad_input} for no curves or values that are not finite. What is smoothed is so on the
  // device of `compute` (kernels/local_linear.h: within 1e-11 of the largest value, 1e-4 on one without double).
  [[nodiscard]] FunctionalPca fit(const CurveView& curves, const Compute& compute = {});
  // The same from moments; the noise variance of unsmoothed curves then comes from their scatter, a few digits coarser.
  [[nodiscard]] FunctionalPca fit(const CurveMoments& moments, const Compute& compute = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// One-off use.
[[nodiscard]] FunctionalPca fit_functional_pca(const CurveView& curves, const FpcaOptions& options = {},
                                               Domain domain = {}, const Compute& compute = {});
[[nodiscard]] FunctionalPca fit_functional_pca(const CurveMoments& moments, const FpcaOptions& options = {},
                                               Domain domain = {}, const Compute& compute = {});

// The weights of the trapezoid rule on `points` equidistant points over a length; one point weighs 1.
[[nodiscard]] Eigen::VectorXd trapezoid_weights(int points, double length);

}  // namespace kinespace
