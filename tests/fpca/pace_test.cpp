// Smoothing, noise and conditional scores, on curves whose truth is known. golden_test.cpp compares with the package.
#include <armadillo>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/functional_pca.h"
#include "kinespace/fpca/symmetric_eigen.h"
#include "tests/fpca/sample_curves.h"

namespace kinespace {
namespace {

FpcaOptions noisy(FpcaMode mode) {
  return {.mode = mode,
          .mean = MeanEstimate::smooth,
          .smooth_covariance = true,
          .estimate_noise = true,
          .mean_bandwidth = 0.06,
          .variance_share = 0.999,
          .scores = ScoreKind::conditional};
}

constexpr FpcaMode both_modes[] = {FpcaMode::consistent, FpcaMode::pace};

// Lambda Phi' (Phi Lambda Phi' + sigma^2 I)^-1 (y - mu), with every kept function in the covariance, solved for each
// curve.
TEST(ConditionalScores, equal_the_direct_solution_for_each_curve) {
  const CurveMatrix y = test::sample_curves(50, 45, 0.2);
  for (const FpcaMode mode : both_modes) {
    FpcaOptions options = noisy(mode);
    const FunctionalPca f = fit_functional_pca(y, options);
    options.count = 20;  // the kept functions, to build the fitted covariance from
    const FunctionalPca kept = fit_functional_pca(y, options);
    ASSERT_LT(f.count(), kept.count());
    const Eigen::MatrixXd fitted =
        kept.observed_functions * kept.eigenvalues.asDiagonal() * kept.observed_functions.transpose();
    const Eigen::MatrixXd covariance = fitted + *f.noise_variance * Eigen::MatrixXd::Identity(45, 45);
    const Eigen::MatrixXd with_scores = f.observed_functions * f.eigenvalues.asDiagonal();
    const Eigen::LDLT<Eigen::MatrixXd> solver(covariance);
    const CurveMatrix xi = f.scores(y);
    for (Eigen::Index i = 0; i < y.rows(); ++i) {
      const Eigen::VectorXd direct = with_scores.transpose() * solver.solve(y.row(i).transpose() - f.observed_mean);
      EXPECT_LE((xi.row(i).transpose() - direct).cwiseAbs().maxCoeff(), 1e-11);
    }
    Eigen::MatrixXd posterior = -with_scores.transpose() * solver.solve(with_scores);
    posterior.diagonal() += f.eigenvalues;
    EXPECT_LE((f.posterior_covariance - posterior).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(ConditionalScores, without_noise_are_the_least_squares_fit) {
  const CurveMatrix y = test::sample_curves(30, 40, 0.1);
  const FunctionalPca f = fit_functional_pca(y, {.count = 6, .scores = ScoreKind::conditional, .max_functions = 6});
  const CurveMatrix xi = f.scores(y);
  const Eigen::MatrixXd centred = (y.rowwise() - f.observed_mean.transpose()).transpose();
  const Eigen::MatrixXd fit = f.observed_functions.householderQr().solve(centred);
  EXPECT_LE((xi.transpose() - fit).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_EQ(f.posterior_covariance.cwiseAbs().maxCoeff(), 0);
}

TEST(ConditionalScores, are_nearer_the_truth_than_integration_when_curves_are_noisy) {
  constexpr int points = 25;
  const CurveMatrix truth = test::sample_curves(4000, points, 0, 11);
  CurveMatrix y = truth + 0.8 * test::random_curves(4000, points, 12);
  const FunctionalPca f = fit_functional_pca(y, {.estimate_noise = true, .count = 5, .scores = ScoreKind::conditional});
  const auto error = [&](ScoreKind kind) { return (f.reconstruct(f.scores(y, kind)) - truth).squaredNorm(); };
  EXPECT_LT(error(ScoreKind::conditional), 0.9 * error(ScoreKind::integration));
}

TEST(Noise, is_estimated_from_the_ridge_and_from_second_differences) {
  const CurveMatrix y = test::sample_curves(2000, 80, 0.2);  // variance 0.04
  for (const FpcaMode mode : both_modes) {
    FpcaOptions narrow = noisy(mode);  // what the ridge's bandwidth smooths away counts as noise
    narrow.covariance_bandwidth = 0.05;
    EXPECT_NEAR(*fit_functional_pca(y, narrow).noise_variance, 0.04, 0.003);
    EXPECT_NEAR(*fit_functional_pca(y, {.mode = mode, .estimate_noise = true}).noise_variance, 0.04, 0.002);
  }
  EXPECT_FALSE(fit_functional_pca(y).noise_variance.has_value());
}

TEST(Noise, kept_out_of_the_covariance_leaves_the_signals_eigenvalues) {
  const CurveMatrix y = test::sample_curves(3000, 60, 0.4);
  const FunctionalPca with = fit_functional_pca(y, noisy(FpcaMode::consistent));
  EXPECT_LE(with.count(), 7);
  EXPECT_NEAR(with.eigenvalues[0], 1, 0.1);
  EXPECT_NEAR(with.eigenvalues[1], 0.4, 0.05);
  EXPECT_GT(fit_functional_pca(y, {.variance_share = 0.999}).count(), 30) << "or the noise was never there";
}

TEST(Noise, from_moments_equals_that_from_curves) {
  const CurveMatrix y = test::sample_curves(300, 50, 0.01);
  CurveMoments moments(50);
  moments.add(y);
  const FpcaOptions options{.estimate_noise = true};
  const double a = *fit_functional_pca(y, options).noise_variance,
               b = *fit_functional_pca(moments, options).noise_variance;
  EXPECT_NEAR(a / b, 1, 1e-9);
}

TEST(Smoothing, finds_the_functions_under_noise) {
  const CurveMatrix y = test::sample_curves(4000, 60, 0.3);
  for (const FpcaMode mode : both_modes) {
    const FunctionalPca f = fit_functional_pca(y, noisy(mode));
    for (int k = 0; k < 2; ++k) {
      double product = 0;
      for (int t = 0; t < 60; ++t) product += f.weights[t] * f.functions(t, k) * test::sample_function(k, f.grid[t]);
      EXPECT_GT(std::abs(product), 0.98) << k;
    }
    for (int t = 0; t < 60; ++t) EXPECT_NEAR(f.mean[t], test::sample_mean(f.grid[t]), 0.15);
  }
}

// A local linear fit has a bandwidth, and so flattens peaks however many curves there are; the spline knows its noise.
TEST(Smoothing, of_the_mean_by_a_spline_takes_noise_and_leaves_the_rest) {
  constexpr int points = 80;
  Eigen::VectorXd truth(points);
  for (int t = 0; t < points; ++t) truth[t] = test::sample_mean(t / (points - 1.0));
  // The curves' own part of the mean is no noise.
  const auto error = [&](int curves, double noise, MeanEstimate mean) {
    const CurveMatrix clean = test::sample_curves(curves, points, 0, 4);
    const CurveMatrix y = clean + noise * test::random_curves(curves, points, 9);
    const FunctionalPca f = fit_functional_pca(y, {.mean = mean, .estimate_noise = true, .count = 2});
    return (f.observed_mean - clean.colwise().mean().transpose()).norm();
  };
  const double few = error(20, 1, MeanEstimate::spline);
  EXPECT_LT(few, 0.6 * error(20, 1, MeanEstimate::cross_sectional));
  EXPECT_LT(few, error(20, 1, MeanEstimate::smooth));
  EXPECT_LT(error(4000, 0.1, MeanEstimate::spline), 0.5 * error(4000, 0.1, MeanEstimate::smooth));
  EXPECT_LT(error(50, 0, MeanEstimate::spline), 0.2 * error(50, 0, MeanEstimate::smooth));
}

TEST(Smoothing, keeps_the_functions_of_the_consistent_mode_orthonormal) {
  const FunctionalPca f = fit_functional_pca(test::sample_curves(200, 70, 0.2), noisy(FpcaMode::consistent));
  const Eigen::MatrixXd gram = f.functions.transpose() * f.weights.asDiagonal() * f.functions;
  EXPECT_LE((gram - Eigen::MatrixXd::Identity(f.count(), f.count())).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Smoothing, on_too_few_points_is_an_error_that_says_what_to_do) {
  for (const int points : {1, 2, 3, 10}) {
    try {
      (void)fit_functional_pca(test::sample_curves(30, points), {.smooth_covariance = true});
      FAIL() << points;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::usage);
      EXPECT_THAT(e.what(), ::testing::HasSubstr("use a bandwidth of"));
    }
  }
}

TEST(Scores, shrink_by_what_may_be_noise) {
  const CurveMatrix y = test::sample_curves(100, 50, 0.3);
  FpcaOptions options{.estimate_noise = true, .count = 5};
  const FunctionalPca plain = fit_functional_pca(y, options, {0, 2});
  options.shrink = true;
  const FunctionalPca shrunk = fit_functional_pca(y, options, {0, 2});
  const double noise = 2 * *plain.noise_variance / 50;
  for (int k = 0; k < 5; ++k) {
    const double factor = plain.eigenvalues[k] / (plain.eigenvalues[k] + noise);
    EXPECT_LT(factor, 1);
    EXPECT_LE((factor * plain.scores(y).col(k) - shrunk.scores(y).col(k)).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(WorkGrid, of_a_linear_surface_changes_nothing_but_the_points) {
  // Curves a + b u: their covariance is bilinear, which linear interpolation reproduces.
  CurveMatrix y(40, 21);
  const CurveMatrix ab = test::random_curves(40, 2, 2);
  for (int t = 0; t < 21; ++t) y.col(t) = ab.col(0) + ab.col(1) * (t / 20.0);
  const FunctionalPca f = fit_functional_pca(y, {.mode = FpcaMode::pace, .count = 2, .work_points = 11});
  ASSERT_EQ(f.functions.rows(), 11);
  EXPECT_EQ(f.observed_functions.rows(), 21);
  for (int t = 0; t < 11; ++t) EXPECT_NEAR(f.mean[t], f.observed_mean[Eigen::Index{2} * t], 1e-12);
  EXPECT_LE((f.observed_functions(Eigen::seqN(0, 11, 2), Eigen::all) - f.functions).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::RowVectorXd mean = y.colwise().mean();
  const Eigen::MatrixXd centred = y.rowwise() - mean;
  EXPECT_NEAR(f.covariance(3, 7), centred.col(6).dot(centred.col(14)) / 39, 1e-12);
}

// The fast path beside the plain one.
TEST(SymmetricEigen, agrees_with_a_full_decomposition) {
  for (const int size : {1, 2, 3, 17, 100}) {
    const CurveMatrix y = test::random_curves(size + 5, size, 7);
    const Eigen::MatrixXd matrix = y.transpose() * y;
    SymmetricEigen eigen;
    const Eigen::VectorXd values = eigen.decompose(matrix);
    const arma::mat copy(matrix.data(), matrix.rows(), matrix.cols());
    arma::vec all_values;
    arma::mat all_vectors;
    ASSERT_TRUE(arma::eig_sym(all_values, all_vectors, copy));
    for (const int count : {1, (size + 1) / 2, size}) {
      const Eigen::MatrixXd vectors = eigen.vectors(count);
      ASSERT_EQ(vectors.cols(), count);
      for (int j = 0; j < count; ++j) {
        const auto other = static_cast<arma::uword>(size - 1 - j);
        EXPECT_NEAR(values[j], all_values[other], 1e-11 * values[0]);
        const Eigen::Map<const Eigen::VectorXd> expected(all_vectors.colptr(other), size);
        EXPECT_NEAR(std::abs(expected.dot(vectors.col(j))), 1, 1e-9);
      }
    }
  }
}

TEST(SymmetricEigen, keeps_vectors_of_equal_values_orthonormal) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(60, 60);
  matrix(0, 0) = 3;
  matrix.bottomRightCorner(20, 20) *= 1e-14;
  SymmetricEigen eigen;
  (void)eigen.decompose(matrix);
  const Eigen::MatrixXd v = eigen.vectors(60);
  EXPECT_LE((v.transpose() * v - Eigen::MatrixXd::Identity(60, 60)).cwiseAbs().maxCoeff(), 1e-13);
}

}  // namespace
}  // namespace kinespace
