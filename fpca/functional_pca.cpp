#include "kinespace/fpca/functional_pca.h"

#include <cmath>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/fpca/detail/blas.h"

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

FunctionalPca fit_functional_pca(const CurveView& curves, const FpcaOptions& options, Domain domain) {
  return FunctionalPcaWorkspace(static_cast<int>(curves.cols()), options, domain).fit(curves);
}

FunctionalPca fit_functional_pca(const CurveMoments& moments, const FpcaOptions& options, Domain domain) {
  return FunctionalPcaWorkspace(moments.points(), options, domain).fit(moments);
}

}  // namespace kinespace
