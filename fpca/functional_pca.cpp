#include "kinespace/fpca/functional_pca.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/fpca/conditional_scores.h"
#include "kinespace/fpca/detail/blas.h"
#include "kinespace/fpca/symmetric_eigen.h"
#include "kinespace/numerics/spline.h"

namespace kinespace {
namespace {

void require(bool legal, const char* field, const std::string& value, const char* range) {
  if (legal) return;
  throw Error(ErrorKind::usage, {.found = std::string("FpcaOptions::") + field + " = " + value, .expected = range});
}

void require_bandwidth(double value, const char* field) {
  require(value > 0 && value <= 10, field, std::to_string(value), "a share of the domain in (0, 10]");
}

void require_columns(Eigen::Index found, Eigen::Index expected, const char* what) {
  if (found == expected) return;
  throw Error(ErrorKind::usage, {.found = std::to_string(found) + " " + what, .expected = std::to_string(expected)});
}

}  // namespace

void FpcaOptions::validate() const {
  require_bandwidth(mean_bandwidth, "mean_bandwidth");
  require_bandwidth(covariance_bandwidth, "covariance_bandwidth");
  require(variance_share > 0 && variance_share <= 1, "variance_share", std::to_string(variance_share),
          "a value in (0, 1]");
  require(!count || *count >= 0, "count", std::to_string(count.value_or(0)), "0 or more functions");
  require(!shrink || estimate_noise, "shrink", "true", "estimate_noise too");
  require(!truncate_noise || (estimate_noise && scores == ScoreKind::conditional), "truncate_noise", "true",
          "estimate_noise and conditional scores too");
  require(work_points == 0 || work_points >= 2, "work_points", std::to_string(work_points), "0, or 2 or more points");
  require(work_points == 0 || mode == FpcaMode::pace, "work_points", std::to_string(work_points),
          "0 in consistent mode, where functions must stay orthonormal on the curves' points");
  require(max_functions >= 0, "max_functions", std::to_string(max_functions), "0 or more functions");
}

Eigen::VectorXd trapezoid_weights(int points, double length) {
  if (points < 2) return Eigen::VectorXd::Ones(points);
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(points, length / (points - 1));
  weights[0] *= 0.5;
  weights[points - 1] *= 0.5;
  return weights;
}

CurveMatrix FunctionalPca::scores(const CurveView& samples, ScoreKind kind) const {
  require_columns(samples.cols(), points(), "points in a curve");
  if (kind == ScoreKind::conditional && options.scores != ScoreKind::conditional) {
    throw Error(ErrorKind::usage, {.found = "conditional scores of a fit without them",
                                   .expected = "FpcaOptions::scores = conditional when it was fitted"});
  }
  const CurveMatrix& projection = kind == ScoreKind::conditional ? conditional : integration;
  blas::use_one_thread();
  const Eigen::RowVectorXd offset = -(projection * observed_mean).transpose();
  CurveMatrix out = offset.replicate(samples.rows(), 1);
  blas::project_rows(samples.data(), samples.rows(), samples.cols(), samples.outerStride(), projection.data(), count(),
                     1, out.data());
  if (!out.allFinite()) require_finite(samples);
  return out;
}

CurveMatrix FunctionalPca::reconstruct(const CurveView& scores) const {
  if (scores.cols() > count()) require_columns(scores.cols(), count(), "scores of a curve");
  blas::use_one_thread();
  const CurveMatrix rows = observed_functions.leftCols(scores.cols());
  CurveMatrix out = observed_mean.transpose().replicate(scores.rows(), 1);
  if (scores.cols() == 0) return out;
  blas::project_rows(scores.data(), scores.rows(), scores.cols(), scores.outerStride(), rows.data(), points(), 1,
                     out.data());
  return out;
}

FunctionalPca fit_functional_pca(const CurveView& curves, const FpcaOptions& options, Domain domain,
                                 const Compute& compute) {
  return FunctionalPcaWorkspace(static_cast<int>(curves.cols()), options, domain).fit(curves, compute);
}

FunctionalPca fit_functional_pca(const CurveMoments& moments, const FpcaOptions& options, Domain domain,
                                 const Compute& compute) {
  return FunctionalPcaWorkspace(moments.points(), options, domain).fit(moments, compute);
}

// FunctionalPcaWorkspace: the steps of a fit, in the order PACE takes them.

namespace {

// Position of point i of n in [0, 1].
double position(int i, int n) {
  return n < 2 ? 0 : static_cast<double>(i) / (n - 1);
}

std::vector<double> positions(int n) {
  std::vector<double> out(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = position(i, n);
  return out;
}

Eigen::VectorXd to_eigen(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

// Rows to rows: linear interpolation from a grid of `from` points to one of `to` points over the same domain.
Eigen::MatrixXd linear_interpolation(int from, int to) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(to, from);
  for (int i = 0; i < to; ++i) {
    const double place = position(i, to) * (from - 1);
    const int left = std::clamp(static_cast<int>(place), 0, std::max(from - 2, 0));
    const double share = place - left;
    out(i, left) += 1 - share;
    if (share != 0) out(i, left + 1) += share;
  }
  return out;
}

// The curves' noise variance if they were smooth else: the second difference of white noise has 6 times its variance.
double second_difference_noise(const CurveView& curves) {
  const Eigen::Index inner = curves.cols() - 2;
  if (inner < 1) return 0;
  double sum = 0;
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    const auto y = curves.row(i);
    sum += (y.head(inner) - 2 * y.segment(1, inner) + y.tail(inner)).squaredNorm();
  }
  return sum / (6.0 * static_cast<double>(curves.rows()) * static_cast<double>(inner));
}

double second_difference_noise(const CurveMoments& moments) {
  const Eigen::Index inner = moments.points() - 2;
  if (inner < 1) return 0;
  const Eigen::MatrixXd s = moments.scatter() / static_cast<double>(moments.count());
  const Eigen::VectorXd& m = moments.mean();
  double sum = 0;
  for (Eigen::Index i = 0; i < inner; ++i) {
    const double step = m[i] - 2 * m[i + 1] + m[i + 2];
    sum += step * step + s(i, i) + 4 * s(i + 1, i + 1) + s(i + 2, i + 2) - 4 * s(i, i + 1) - 4 * s(i + 1, i + 2) +
           2 * s(i, i + 2);
  }
  return sum / (6.0 * static_cast<double>(inner));
}

// The package's answer to an estimate below zero.
double positive_noise(double estimate) {
  return estimate < 0 ? 1e-6 : estimate;
}

}  // namespace

struct FunctionalPcaWorkspace::Parts {
  Parts(int point_count, const FpcaOptions& fit_options, Domain fit_domain);

  FunctionalPca fit(const CurveMoments& moments, double second_difference_variance, const Compute& compute);

  int points;
  int work_points;
  FpcaOptions options;
  Domain domain;
  Eigen::VectorXd weights;     // of the work grid
  std::vector<double> places;  // of the curves' points in [0, 1]
  std::vector<double> middle;  // places of the work grid in the middle half
  std::optional<LocalLinearSurface> surface;
  SymmetricEigen eigen;
  Eigen::MatrixXd raw, problem;  // work space

 private:
  void find_mean(const CurveMoments& moments, const Compute& compute, FunctionalPca& out);
  void find_covariance(const CurveMoments& moments, double second_difference_variance, const Compute& compute,
                       FunctionalPca& out);
  void find_noise(const Compute& compute, FunctionalPca& out);
  void decompose(FunctionalPca& out);
  [[nodiscard]] int positive_values(const FunctionalPca& out) const;
  // How many functions to give, and how many the fitted covariance is made of.
  [[nodiscard]] std::pair<int, int> choose_counts(FunctionalPca& out) const;
  [[nodiscard]] Eigen::MatrixXd scaled_functions(int count, const FunctionalPca& out);
  [[nodiscard]] double sign_of(const Eigen::VectorXd& function, const Eigen::VectorXd& linear_mean) const;
  void find_projections(const CurveMoments& moments, const Eigen::MatrixXd& functions, const Eigen::VectorXd& values,
                        FunctionalPca& out) const;
};

FunctionalPcaWorkspace::Parts::Parts(int point_count, const FpcaOptions& fit_options, Domain fit_domain)
    : points(point_count),
      work_points(fit_options.work_points > 0 ? fit_options.work_points : point_count),
      options(fit_options),
      domain(fit_domain) {
  options.validate();
  if (points < 1) {
    throw Error(ErrorKind::usage,
                {.found = "curves of " + std::to_string(points) + " points", .expected = "at least 1 point"});
  }
  if (!(domain.length() > 0) || !std::isfinite(domain.length())) {
    throw Error(ErrorKind::usage,
                {.found = "a domain from " + std::to_string(domain.start) + " to " + std::to_string(domain.end),
                 .expected = "an end after the start"});
  }
  weights = trapezoid_weights(work_points, domain.length());
  places = positions(points);
  constexpr double slack = 1e-12;  // a grid point may lie on a quarter exactly
  for (int i = 0; i < work_points; ++i) {
    const double p = position(i, work_points);
    if (p >= 0.25 - slack && p <= 0.75 + slack) middle.push_back(p);
  }
  if (options.smooth_covariance) {
    surface.emplace(points, work_points, options.kernel, options.covariance_bandwidth,
                    options.estimate_noise ? Diagonal::left_out : Diagonal::kept);
  }
}

FunctionalPca FunctionalPcaWorkspace::Parts::fit(const CurveMoments& moments, double second_difference_variance,
                                                 const Compute& compute) {
  if (moments.count() < 1) throw Error(ErrorKind::bad_input, {.found = "no curves", .expected = "at least one"});
  if (moments.points() != points) {
    throw Error(ErrorKind::usage, {.found = "curves of " + std::to_string(moments.points()) + " points",
                                   .expected = std::to_string(points)});
  }
  FunctionalPca out;
  out.options = options;
  out.domain = domain;
  out.curve_count = moments.count();
  out.grid = Eigen::VectorXd::LinSpaced(work_points, domain.start, work_points > 1 ? domain.end : domain.start);
  out.weights = trapezoid_weights(points, domain.length());
  find_mean(moments, compute, out);
  find_covariance(moments, second_difference_variance, compute, out);
  decompose(out);
  const auto [count, kept] = choose_counts(out);
  const Eigen::MatrixXd functions = scaled_functions(kept, out);
  const Eigen::VectorXd values = out.all_eigenvalues.head(kept);
  out.functions = functions.leftCols(count);
  out.eigenvalues = values.head(count);
  find_projections(moments, functions, values, out);
  return out;
}

void FunctionalPcaWorkspace::Parts::find_mean(const CurveMoments& moments, const Compute& compute, FunctionalPca& out) {
  out.observed_mean = moments.mean();
  if (options.mean == MeanEstimate::smooth) {
    const Eigen::VectorXd& m = moments.mean();
    out.observed_mean = to_eigen(local_linear_line({m.data(), static_cast<std::size_t>(m.size())}, {}, options.kernel,
                                                   options.mean_bandwidth, places, compute));
  } else if (options.mean == MeanEstimate::spline) {
    const Eigen::VectorXd& m = moments.mean();
    const double noise = std::max(second_difference_noise(moments), 0.0) / static_cast<double>(moments.count());
    out.observed_mean =
        to_eigen(smoothing_spline_for_noise(places, {m.data(), static_cast<std::size_t>(m.size())}, noise).values);
  }
  out.mean = out.observed_mean;
  if (work_points != points) {
    out.mean = to_eigen(interpolate_spline(places, {out.observed_mean.data(), places.size()}, positions(work_points)));
  }
}

void FunctionalPcaWorkspace::Parts::find_covariance(const CurveMoments& moments, double second_difference_variance,
                                                    const Compute& compute, FunctionalPca& out) {
  const double n = static_cast<double>(moments.count());
  if (options.smooth_covariance) {
    moments.covariance(n, raw);
    const Eigen::VectorXd off = moments.mean() - out.observed_mean;
    if (options.mean != MeanEstimate::cross_sectional) raw += off * off.transpose();
    surface->smooth(raw, out.covariance, compute);
    if (options.estimate_noise) find_noise(compute, out);
    return;
  }
  moments.covariance(std::max(n - 1, 1.0), out.covariance);
  if (options.estimate_noise) {
    out.noise_variance = second_difference_variance;
    out.covariance.diagonal().array() -= second_difference_variance;
  }
  if (work_points != points) {
    const Eigen::MatrixXd to_work = linear_interpolation(points, work_points);
    out.covariance = (to_work * out.covariance * to_work.transpose()).eval();
    out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  }
}

// Diagonal with noise less the same without, over the middle half of the domain, where no window is cut.
void FunctionalPcaWorkspace::Parts::find_noise(const Compute& compute, FunctionalPca& out) {
  const Eigen::VectorXd diagonal = raw.diagonal();
  const auto with = local_linear_line({diagonal.data(), static_cast<std::size_t>(diagonal.size())}, {}, options.kernel,
                                      options.covariance_bandwidth, middle, compute);
  const auto without = rotated_quadratic_ridge(raw, options.kernel, options.covariance_bandwidth, middle);
  const auto rows = static_cast<Eigen::Index>(middle.size());
  out.noise_diagonal.resize(rows, 3);
  out.noise_diagonal.col(0) = (domain.start + domain.length() * to_eigen(middle).array()).matrix();
  out.noise_diagonal.col(1) = to_eigen(with);
  out.noise_diagonal.col(2) = to_eigen(without);
  double integral = 0;
  if (rows > 1) {
    const double covered = out.noise_diagonal(rows - 1, 0) - out.noise_diagonal(0, 0);
    integral =
        trapezoid_weights(static_cast<int>(rows), covered).dot(out.noise_diagonal.col(1) - out.noise_diagonal.col(2));
  }
  out.noise_variance = positive_noise(integral / (0.5 * domain.length()));
}

void FunctionalPcaWorkspace::Parts::decompose(FunctionalPca& out) {
  if (options.mode == FpcaMode::pace) {
    const double step = work_points > 1 ? domain.length() / (work_points - 1) : 1;
    out.all_eigenvalues = step * eigen.decompose(out.covariance);
    return;
  }
  const Eigen::VectorXd root = weights.cwiseSqrt();
  problem = root.asDiagonal() * out.covariance * root.asDiagonal();
  out.all_eigenvalues = eigen.decompose(problem);
}

int FunctionalPcaWorkspace::Parts::positive_values(const FunctionalPca& out) const {
  // Equal curves differ from their mean by rounding, and that is no variance.
  constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
  const double mean_square = weights.dot(out.mean.cwiseAbs2());
  if (out.all_eigenvalues[0] <= rounding * rounding * mean_square) return 0;
  const auto& values = out.all_eigenvalues;
  return static_cast<int>(std::partition_point(values.begin(), values.end(), [](double v) { return v > 0; }) -
                          values.begin());
}

std::pair<int, int> FunctionalPcaWorkspace::Parts::choose_counts(FunctionalPca& out) const {
  const bool pace = options.mode == FpcaMode::pace;
  int cap = options.max_functions;
  if (cap == 0) cap = pace && !options.smooth_covariance ? std::max(points - 2, 1) : 20;
  cap = std::max(cap, options.count.value_or(0));
  const int positive = positive_values(out);
  const int counted = pace ? std::min(positive, cap) : positive;

  Eigen::VectorXd shares = out.all_eigenvalues.head(counted);
  for (int j = 1; j < counted; ++j) shares[j] += shares[j - 1];
  if (counted > 0) shares /= shares[counted - 1];
  int count = 0;
  if (options.count) {
    count = std::min(*options.count, counted);
  } else if (counted > 0) {
    while (count + 1 < counted && shares[count] < options.variance_share) ++count;
    ++count;
  }
  out.cumulative_shares = shares.head(count);
  if (options.scores == ScoreKind::integration) return {count, count};
  return {count, std::max(count, std::min(cap, counted))};
}

Eigen::MatrixXd FunctionalPcaWorkspace::Parts::scaled_functions(int count, const FunctionalPca& out) {
  Eigen::MatrixXd functions = eigen.vectors(count);
  Eigen::VectorXd linear_mean = out.observed_mean;
  if (work_points != points) linear_mean = linear_interpolation(points, work_points) * out.observed_mean;
  const Eigen::VectorXd inverse_root = weights.cwiseSqrt().cwiseInverse();
  for (int j = 0; j < count; ++j) {
    auto function = functions.col(j);
    if (options.mode == FpcaMode::pace) {
      function /= std::sqrt(weights.dot(function.cwiseAbs2()));
    } else {
      function = function.cwiseProduct(inverse_root).eval();
    }
    function *= sign_of(function, linear_mean);
  }
  return functions;
}

double FunctionalPcaWorkspace::Parts::sign_of(const Eigen::VectorXd& function,
                                              const Eigen::VectorXd& linear_mean) const {
  if (options.mode == FpcaMode::pace) {
    const double with_mean = function.dot(linear_mean);
    if (with_mean != 0) return with_mean > 0 ? 1 : -1;
  }
  double decaying = 0;
  for (int i = 0; i < work_points; ++i) decaying += weights[i] * function[i] * std::exp(-position(i, work_points));
  return decaying < 0 ? -1 : 1;
}

void FunctionalPcaWorkspace::Parts::find_projections(const CurveMoments& moments, const Eigen::MatrixXd& functions,
                                                     const Eigen::VectorXd& values, FunctionalPca& out) const {
  const int count = out.count();
  Eigen::MatrixXd observed = functions;
  if (work_points != points) observed = linear_interpolation(work_points, points) * functions;
  out.observed_functions = observed.leftCols(count);
  const double noise = out.noise_variance.value_or(0);
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(count);
  if (options.shrink) {
    factor = out.eigenvalues.array() / (out.eigenvalues.array() + domain.length() * noise / points);
  }
  out.integration = factor.asDiagonal() * out.observed_functions.transpose() * out.weights.asDiagonal();
  if (options.scores == ScoreKind::integration) return;

  const ConditionalScores conditional(observed, values, count);
  out.score_noise = noise;
  if (options.truncate_noise) {
    const Eigen::MatrixXd work_gram = out.functions.transpose() * weights.asDiagonal() * out.functions;
    out.score_noise = truncated_noise(conditional, moments, out.observed_mean, out.observed_functions, work_gram,
                                      out.eigenvalues.sum(), noise);
  }
  out.conditional = conditional.projection(out.score_noise);
  out.posterior_covariance = conditional.posterior_covariance(out.score_noise);
}

FunctionalPcaWorkspace::FunctionalPcaWorkspace(int points, const FpcaOptions& options, Domain domain)
    : parts_(std::make_unique<Parts>(points, options, domain)) {}
FunctionalPcaWorkspace::~FunctionalPcaWorkspace() = default;
FunctionalPcaWorkspace::FunctionalPcaWorkspace(FunctionalPcaWorkspace&&) noexcept = default;
FunctionalPcaWorkspace& FunctionalPcaWorkspace::operator=(FunctionalPcaWorkspace&&) noexcept = default;

FunctionalPca FunctionalPcaWorkspace::fit(const CurveView& curves, const Compute& compute) {
  CurveMoments moments(parts_->points);
  moments.add(curves);
  const bool from_differences = parts_->options.estimate_noise && !parts_->options.smooth_covariance;
  return parts_->fit(moments, from_differences && curves.rows() > 0 ? second_difference_noise(curves) : 0, compute);
}

FunctionalPca FunctionalPcaWorkspace::fit(const CurveMoments& moments, const Compute& compute) {
  const bool from_differences = parts_->options.estimate_noise && !parts_->options.smooth_covariance;
  return parts_->fit(moments, from_differences && moments.count() > 0 ? second_difference_noise(moments) : 0, compute);
}

}  // namespace kinespace
