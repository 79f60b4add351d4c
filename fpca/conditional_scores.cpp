#include "kinespace/fpca/conditional_scores.h"

#include <algorithm>
#include <armadillo>
#include <cmath>
#include <limits>

#include "kinespace/base/error.h"
#include "kinespace/fpca/detail/blas.h"
#include "kinespace/kernels/blas_call.h"

namespace kinespace {

ConditionalScores::ConditionalScores(const Eigen::MatrixXd& functions, const Eigen::VectorXd& eigenvalues, int wanted)
    : functions_(functions), wanted_(wanted) {
  const Eigen::Index kept = eigenvalues.size();
  root_vectors_.resize(kept, kept);
  values_.resize(kept);
  if (kept == 0) return;
  blas::use_one_thread();
  const Eigen::VectorXd root = eigenvalues.cwiseSqrt();
  const Eigen::MatrixXd scaled = functions_ * root.asDiagonal();
  const Eigen::MatrixXd gram = scaled.transpose() * scaled;
  const auto size = static_cast<arma::uword>(kept);
  const arma::mat view(const_cast<double*>(gram.data()), size, size, false, true);  // NOLINT: read only
  arma::vec values(values_.data(), size, false, true);
  arma::mat vectors(root_vectors_.data(), size, size, false, true);
  const BlasCall call;
  if (!arma::eig_sym(values, vectors, view)) {
    throw Error(ErrorKind::machine,
                {.found = "an eigenproblem that did not converge", .expected = "conditional scores"});
  }
  root_vectors_ = root.asDiagonal() * root_vectors_;
}

Eigen::MatrixXd ConditionalScores::inverse(double noise) const {
  // Without noise a direction that the points do not see has no score.
  const double floor = values_.size() == 0 ? 0 : 1e-14 * values_.maxCoeff();
  const Eigen::VectorXd weights = values_.unaryExpr(
      [&](double v) { return std::max(v, 0.0) + noise > floor ? 1 / (std::max(v, 0.0) + noise) : 0.0; });
  return root_vectors_.topRows(wanted_) * weights.asDiagonal() * root_vectors_.transpose();
}

Eigen::MatrixXd ConditionalScores::projection(double noise) const {
  return inverse(noise) * functions_.transpose();
}

Eigen::MatrixXd ConditionalScores::posterior_covariance(double noise) const {
  return noise * inverse(noise).leftCols(wanted_);
}

double truncated_noise(const ConditionalScores& scores, const CurveMoments& moments, const Eigen::VectorXd& centre,
                       const Eigen::MatrixXd& wanted_functions, const Eigen::MatrixXd& work_gram, double eigenvalue_sum,
                       double noise) {
  const double count = static_cast<double>(moments.count());
  const Eigen::MatrixXd scatter = moments.scatter();
  const Eigen::VectorXd off = moments.mean() - centre;
  const Eigen::MatrixXd about_centre = scatter / count + off * off.transpose();
  const Eigen::MatrixXd gram = wanted_functions.transpose() * wanted_functions;
  for (int round = 0; round < 2; ++round) {
    const Eigen::MatrixXd p = scores.projection(noise);
    const Eigen::MatrixXd pm = p * about_centre;
    const double residual = about_centre.trace() - 2 * pm.cwiseProduct(wanted_functions.transpose()).sum() +
                            (pm * p.transpose()).cwiseProduct(gram).sum();
    noise = std::max(residual / static_cast<double>(centre.size()), 0.0);
  }
  if (moments.count() < 2) return noise;
  constexpr int candidates = 50;
  double best = noise, best_gap = std::numeric_limits<double>::infinity();
  for (int c = 0; c < candidates; ++c) {
    const double candidate = noise * (1 + 9.0 * c / (candidates - 1));
    const Eigen::MatrixXd p = scores.projection(candidate);
    const double variance = (p * (scatter / (count - 1)) * p.transpose()).cwiseProduct(work_gram).sum();
    const double gap = std::abs(eigenvalue_sum - variance);
    if (gap < best_gap) {
      best_gap = gap;
      best = candidate;
    }
  }
  return best;
}

}  // namespace kinespace
