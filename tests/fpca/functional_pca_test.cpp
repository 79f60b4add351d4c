// The consistent mode, and what both modes share. pace_test.cpp has smoothing, noise and conditional scores.
#include "kinespace/fpca/functional_pca.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/fpca/sample_curves.h"

namespace kinespace {
namespace {

FpcaOptions all_functions(int points) {
  return {.count = points};
}

// The exact moments of the model behind sample_curves, as if of 1001 curves.
CurveMoments model_moments(int points) {
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(points, points);
  Eigen::VectorXd mean(points);
  for (int t = 0; t < points; ++t) mean[t] = test::sample_mean(static_cast<double>(t) / (points - 1));
  for (int k = 0; k < 5; ++k) {
    Eigen::VectorXd f(points);
    for (int t = 0; t < points; ++t) f[t] = test::sample_function(k, static_cast<double>(t) / (points - 1));
    scatter += 1000 * test::sample_eigenvalues[k] * f * f.transpose();
  }
  return {1001, mean, scatter};
}

double gram_error(const FunctionalPca& f) {
  const Eigen::MatrixXd gram = f.functions.transpose() * f.weights.asDiagonal() * f.functions;
  return (gram - Eigen::MatrixXd::Identity(f.count(), f.count())).cwiseAbs().maxCoeff();
}

TEST(FunctionalPca, finds_the_functions_of_a_known_process) {
  for (const int points : {9, 64, 101}) {
    const FunctionalPca f = fit_functional_pca(model_moments(points), {.count = 5});
    ASSERT_EQ(f.count(), 5);
    for (int k = 0; k < 5; ++k) {
      EXPECT_NEAR(f.eigenvalues[k], test::sample_eigenvalues[k], 1e-12);
      for (int t = 0; t < points; ++t) {
        // cos(k pi u) starts high, and the sign convention keeps it so.
        EXPECT_NEAR(f.functions(t, k), test::sample_function(k, f.grid[t]), 1e-10) << k << " " << t;
      }
    }
    EXPECT_NEAR(f.cumulative_shares[0], 1 / 1.61, 1e-12);
  }
}

TEST(FunctionalPca, the_functions_are_orthonormal_in_the_inner_product_of_the_scores) {
  for (const int points : {2, 3, 50, 100, 257}) {
    const FunctionalPca f = fit_functional_pca(test::random_curves(300, points, 3), all_functions(points), {0, 2.5});
    EXPECT_EQ(f.count(), points);
    EXPECT_LE(gram_error(f), 1e-12) << points;
  }
  // Eigenvalues over fifteen orders of magnitude, as clean motion has them.
  EXPECT_LE(gram_error(fit_functional_pca(test::sample_curves(200, 100), {.variance_share = 1})), 1e-12);
}

TEST(FunctionalPca, scores_are_uncorrelated_and_their_variances_are_the_eigenvalues) {
  const CurveMatrix y = test::sample_curves(400, 60, 0.1);
  const FunctionalPca f = fit_functional_pca(y, {.count = 12}, {1, 3});
  const Eigen::MatrixXd xi = f.scores(y);
  EXPECT_LE(xi.colwise().mean().cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::MatrixXd covariance = xi.transpose() * xi / 399;
  const Eigen::MatrixXd expected = f.eigenvalues.asDiagonal();
  EXPECT_LE((covariance - expected).cwiseAbs().maxCoeff(), 1e-12 * f.eigenvalues[0]);
}

TEST(FunctionalPca, all_functions_reconstruct_every_curve) {
  const CurveMatrix y = test::sample_curves(300, 40, 0.1);
  const FunctionalPca f = fit_functional_pca(y, all_functions(40));
  EXPECT_LE((f.reconstruct(f.scores(y)) - y).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(FunctionalPca, fewer_curves_than_points_are_reconstructed_too) {
  const CurveMatrix y = test::random_curves(10, 40, 5);
  const FunctionalPca f = fit_functional_pca(y, {.variance_share = 1});
  EXPECT_GE(f.count(), 9);
  EXPECT_LE((f.reconstruct(f.scores(y)) - y).cwiseAbs().maxCoeff(), 1e-6);
}

// What is left out of a prefix is known from the scores alone.
TEST(FunctionalPca, parseval_gives_the_error_of_a_prefix) {
  const CurveMatrix y = test::sample_curves(60, 50, 0.1, 4);
  const FunctionalPca f = fit_functional_pca(y, all_functions(50), {0, 3});
  ASSERT_EQ(f.count(), 50);
  const CurveMatrix xi = f.scores(y);
  for (const int kept : {0, 1, 3, 10, 49}) {
    const CurveMatrix difference = f.reconstruct(xi.leftCols(kept)) - y;
    const Eigen::VectorXd squared_error = difference.cwiseAbs2() * f.weights;
    const Eigen::VectorXd left_out = xi.rightCols(50 - kept).rowwise().squaredNorm();
    EXPECT_LE((squared_error - left_out).cwiseAbs().maxCoeff(), 1e-12) << kept;
  }
}

TEST(FunctionalPca, takes_the_fewest_functions_that_reach_the_share) {
  const CurveMatrix y = test::sample_curves(500, 60, 0.05);
  const FunctionalPca all = fit_functional_pca(y, all_functions(60));
  for (const double share : {0.3, 0.9, 0.99, 0.9999}) {
    const FunctionalPca f = fit_functional_pca(y, {.variance_share = share});
    ASSERT_GE(f.count(), 1);
    EXPECT_GE(all.cumulative_shares[f.count() - 1], share);
    if (f.count() > 1) {
      EXPECT_LT(all.cumulative_shares[f.count() - 2], share);
    }
  }
}

TEST(FunctionalPca, curves_that_are_all_the_same_have_a_mean_and_no_functions) {
  for (const double value : {0.0, 0.1, 1e6}) {
    const CurveMatrix y = CurveMatrix::Constant(700, 30, value);
    for (const bool smooth : {false, true}) {
      const FunctionalPca f = fit_functional_pca(y, {.smooth_covariance = smooth, .count = 4});
      EXPECT_EQ(f.count(), 0);
      EXPECT_EQ(f.scores(y).cols(), 0);
      EXPECT_LE((f.reconstruct(f.scores(y)) - y).cwiseAbs().maxCoeff(), 1e-12 * value);
    }
  }
}

TEST(FunctionalPca, one_curve_is_its_own_mean) {
  const CurveMatrix y = test::sample_curves(1, 20);
  const FunctionalPca f = fit_functional_pca(y);
  EXPECT_EQ(f.count(), 0);
  EXPECT_EQ(f.curve_count, 1);
  EXPECT_EQ(f.reconstruct(f.scores(y)), y);
}

TEST(FunctionalPca, two_curves_need_one_function) {
  const CurveMatrix y = test::sample_curves(2, 20);
  const FunctionalPca f = fit_functional_pca(y);
  ASSERT_EQ(f.count(), 1);
  const CurveMatrix xi = f.scores(y);
  EXPECT_NEAR(xi(0, 0), -xi(1, 0), 1e-12);
  EXPECT_LE((f.reconstruct(xi) - y).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(FunctionalPca, works_on_grids_of_one_two_and_three_points) {
  for (const int points : {1, 2, 3}) {
    for (const FpcaMode mode : {FpcaMode::consistent, FpcaMode::pace}) {
      const CurveMatrix y = test::random_curves(50, points, 9);
      const FunctionalPca f = fit_functional_pca(y, {.mode = mode, .count = points});
      ASSERT_EQ(f.count(), points);
      EXPECT_EQ(f.weights.size(), points);
      if (mode == FpcaMode::consistent) {
        EXPECT_LE((f.reconstruct(f.scores(y)) - y).cwiseAbs().maxCoeff(), 1e-12);
      }
    }
  }
}

TEST(FunctionalPca, merged_moments_give_what_all_curves_give) {
  const CurveMatrix y = test::sample_curves(801, 50, 0.1);
  CurveMoments first(50), second(50);
  first.add(y.topRows(400));
  second.add(y.bottomRows(401));
  first.merge(second);
  const FunctionalPca whole = fit_functional_pca(y, {.count = 10}), merged = fit_functional_pca(first, {.count = 10});
  EXPECT_LE((whole.eigenvalues - merged.eigenvalues).cwiseAbs().maxCoeff(), 1e-10 * whole.eigenvalues[0]);
  EXPECT_LE((whole.functions - merged.functions).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LE((whole.mean - merged.mean).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(FunctionalPca, the_order_of_the_curves_does_not_matter) {
  const CurveMatrix y = test::sample_curves(500, 40, 0.1);
  const CurveMatrix reversed = y.colwise().reverse();
  const FunctionalPca a = fit_functional_pca(y, {.count = 6}), b = fit_functional_pca(reversed, {.count = 6});
  EXPECT_LE((a.functions - b.functions).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(FunctionalPca, has_the_same_bits_in_any_thread_and_from_a_used_workspace) {
  const FpcaOptions options{.mean = MeanEstimate::smooth,
                            .smooth_covariance = true,
                            .estimate_noise = true,
                            .scores = ScoreKind::conditional};
  const CurveMatrix y = test::sample_curves(900, 70, 0.1);
  const CurveMatrix alone = fit_functional_pca(y, options).scores(y);
  std::vector<CurveMatrix> together(3);
  {
    std::vector<std::jthread> threads;
    threads.reserve(together.size());
    for (auto& out : together) threads.emplace_back([&] { out = fit_functional_pca(y, options).scores(y); });
  }
  for (const auto& scores : together) EXPECT_EQ(scores, alone);
  FunctionalPcaWorkspace workspace(70, options);
  (void)workspace.fit(test::random_curves(90, 70, 1));
  EXPECT_EQ(workspace.fit(y).scores(y), alone);
}

TEST(FunctionalPca, signs_follow_the_rule_whatever_the_curves_signs) {
  const CurveMatrix y = test::sample_curves(300, 40, 0.1);
  const FunctionalPca f = fit_functional_pca(y, {.count = 8}), mirrored = fit_functional_pca(-y, {.count = 8});
  EXPECT_LE((f.functions - mirrored.functions).cwiseAbs().maxCoeff(), 1e-11);
  for (int k = 0; k < 8; ++k) {
    EXPECT_GT(f.functions.col(k).dot((f.weights.array() * (-f.grid.array()).exp()).matrix()), 0);
  }
}

TEST(FunctionalPca, a_longer_domain_scales_eigenvalues_and_functions) {
  const CurveMatrix y = test::sample_curves(200, 30, 0.1);
  const FunctionalPca one = fit_functional_pca(y, {.count = 4}), four = fit_functional_pca(y, {.count = 4}, {10, 14});
  EXPECT_LE((4 * one.eigenvalues - four.eigenvalues).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LE((0.5 * one.functions - four.functions).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(four.grid[0], 10);
  EXPECT_EQ(four.grid[29], 14);
}

TEST(FunctionalPca, drops_eigenvalues_below_zero_before_it_counts_shares) {
  const CurveMatrix y = test::sample_curves(40, 60, 0.3);  // fewer curves than points, and noise taken off the diagonal
  for (const FpcaMode mode : {FpcaMode::consistent, FpcaMode::pace}) {
    const FunctionalPca f = fit_functional_pca(y, {.mode = mode, .estimate_noise = true, .variance_share = 1});
    EXPECT_LT(f.all_eigenvalues.minCoeff(), 0);
    EXPECT_GT(f.eigenvalues.minCoeff(), 0);
    EXPECT_LT(f.count(), 60);
    EXPECT_NEAR(f.cumulative_shares[f.count() - 1], 1, 1e-12);
    EXPECT_NEAR(f.cumulative_shares[0], f.eigenvalues[0] / f.all_eigenvalues.cwiseMax(0).sum(), 1e-12);
  }
}

TEST(FunctionalPca, names_what_is_wrong_with_the_curves) {
  CurveMatrix y = test::sample_curves(30, 20);
  const FunctionalPca f = fit_functional_pca(y);
  EXPECT_THROW((void)fit_functional_pca(CurveMatrix(0, 20)), Error);
  EXPECT_THROW((void)fit_functional_pca(CurveMatrix(5, 0)), Error);
  EXPECT_THROW((void)f.scores(test::sample_curves(3, 19)), Error);
  EXPECT_THROW((void)f.reconstruct(CurveMatrix::Zero(3, f.count() + 1)), Error);
  EXPECT_THROW((void)f.scores(y, ScoreKind::conditional), Error);
  EXPECT_THROW((void)FunctionalPcaWorkspace(20, {}, {1, 1}), Error);
  EXPECT_THROW((void)FunctionalPcaWorkspace(20, {}).fit(test::sample_curves(3, 19)), Error);
  y(7, 2) = std::numeric_limits<double>::quiet_NaN();
  for (const auto& use :
       std::vector<std::function<void()>>{[&] { (void)fit_functional_pca(y); }, [&] { (void)f.scores(y); }}) {
    try {
      use();
      FAIL() << "took NaN";
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr("curve 8 at point 3"));
    }
  }
}

TEST(FpcaOptions, name_the_field_its_value_and_its_range) {
  const auto message = [](const FpcaOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::usage);
      return e.what();
    }
    return "";
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(message({}), "");
  EXPECT_THAT(message({.mean_bandwidth = 0}), HasSubstr("mean_bandwidth = 0"));
  EXPECT_THAT(message({.covariance_bandwidth = std::nan("")}), HasSubstr("covariance_bandwidth = nan"));
  EXPECT_THAT(message({.variance_share = 1.5}), HasSubstr("variance_share = 1.5"));
  EXPECT_THAT(message({.count = -1}), HasSubstr("count = -1"));
  EXPECT_THAT(message({.shrink = true}), HasSubstr("shrink"));
  EXPECT_THAT(message({.truncate_noise = true}), HasSubstr("truncate_noise"));
  EXPECT_THAT(message({.work_points = 31}), HasSubstr("work_points = 31"));
  EXPECT_THAT(message({.mode = FpcaMode::pace, .work_points = 1}), HasSubstr("work_points = 1"));
  EXPECT_THAT(message({.max_functions = -2}), HasSubstr("max_functions = -2"));
}

}  // namespace
}  // namespace kinespace
