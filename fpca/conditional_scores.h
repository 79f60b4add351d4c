// Scores by conditional expectation (PACE; Yao, Mueller, Wang 2005, eq. 4): with y = mu + Phi xi + noise, xi normal,
//
//   E[xi | y] = Lambda Phi' (Phi Lambda Phi' + s I)^-1 (y - mu),
//
// which on a common grid is one matrix for all curves. Pushed through, it is Lambda^1/2 (G + s I)^-1 Lambda^1/2 Phi'
// with G = Lambda^1/2 Phi' Phi Lambda^1/2: as small as the number of functions, symmetric, and the posterior covariance
// s Lambda^1/2 (G + s I)^-1 Lambda^1/2 needs no difference. Private to this folder.
#pragma once

#include <Eigen/Core>

#include "kinespace/fpca/curve_moments.h"

namespace kinespace {

class ConditionalScores {
 public:
  // `functions`: T x K, the whole fitted covariance; scores are wanted of the first `wanted` only. Eigenvalues > 0.
  ConditionalScores(const Eigen::MatrixXd& functions, const Eigen::VectorXd& eigenvalues, int wanted);

  // wanted x T. With noise 0 it is the least-squares fit.
  [[nodiscard]] Eigen::MatrixXd projection(double noise) const;
  // wanted x wanted: the covariance of the scores that the curve leaves open.
  [[nodiscard]] Eigen::MatrixXd posterior_covariance(double noise) const;

 private:
  [[nodiscard]] Eigen::MatrixXd inverse(double noise) const;  // Lambda^1/2 (G + s I)^-1 Lambda^1/2, first `wanted` rows

  Eigen::MatrixXd functions_;
  Eigen::MatrixXd root_vectors_;  // Lambda^1/2 U, where G = U diag(values) U'
  Eigen::VectorXd values_;
  int wanted_;
};

// The package's `methodRho = 'trunc'`: the noise variance for the scores is what two rounds of scoring leave as
// residual, times the factor in [1, 10] whose fitted curves have the variance nearest to the sum of the eigenvalues.
// `centre`: the mean the curves are scored about, T; `work_gram`: integrals of products of the wanted functions.
[[nodiscard]] double truncated_noise(const ConditionalScores& scores, const CurveMoments& moments,
                                     const Eigen::VectorXd& centre, const Eigen::MatrixXd& wanted_functions,
                                     const Eigen::MatrixXd& work_gram, double eigenvalue_sum, double noise);

}  // namespace kinespace
