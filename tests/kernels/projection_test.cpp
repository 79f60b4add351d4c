#include "kinespace/kernels/projection.h"

#include <Eigen/QR>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/kernels/keyframe_distance.h"

namespace kinespace {
namespace {

TEST(projection, onto_a_whole_basis_and_back_gives_the_curves) {
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(Eigen::MatrixXd::Random(24, 24)).householderQ();
  const RowMatrix<double> basis = q;
  const RowMatrix<double> curves = RowMatrix<double>::Random(301, 24);
  const Eigen::VectorXd mean = curves.colwise().mean();
  const auto back = reconstruct(project(curves, mean, basis), mean, basis);
  EXPECT_LT((back - curves).cwiseAbs().maxCoeff(), 1e-13);
  const RowMatrix<float> single = curves.cast<float>();
  const RowMatrix<float> single_basis = basis.cast<float>();
  const Eigen::VectorXf single_mean = mean.cast<float>();
  const auto single_back = reconstruct(project(single, single_mean, single_basis), single_mean, single_basis);
  EXPECT_LT((single_back - single).cwiseAbs().maxCoeff(), 2e-6);
}

TEST(projection, of_the_mean_is_zero_and_nothing_gives_the_mean) {
  const RowMatrix<float> functions = RowMatrix<float>::Random(12, 3);
  const Eigen::VectorXf mean = Eigen::VectorXf::Random(12);
  const RowMatrix<float> curves = mean.transpose().replicate(5, 1);
  EXPECT_EQ(project(curves, mean, functions), (RowMatrix<float>::Zero(5, 3)));
  EXPECT_EQ(reconstruct(RowMatrix<float>::Zero(5, 3), mean, functions), curves);
  EXPECT_EQ(reconstruct(RowMatrix<float>(5, 0), mean, functions.leftCols(0)), curves);
}

TEST(projection, does_not_depend_on_threads) {
  const RowMatrix<float> curves = RowMatrix<float>::Random(3000, 40);
  const RowMatrix<float> functions = RowMatrix<float>::Random(40, 7);
  const Eigen::VectorXf mean = Eigen::VectorXf::Random(40);
  const auto several = project(curves, mean, functions);
  const auto distances = keyframe_distances(curves, curves.topRows(50));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(project(curves, mean, functions), several);
  EXPECT_EQ(keyframe_distances(curves, curves.topRows(50)), distances);
}

TEST(projection, of_sizes_that_do_not_fit_is_a_usage_error) {
  const RowMatrix<float> curves = RowMatrix<float>::Zero(3, 4);
  const Eigen::VectorXf mean = Eigen::VectorXf::Zero(4);
  EXPECT_THROW(static_cast<void>(project(curves, mean, RowMatrix<float>::Zero(5, 2))), Error);
  EXPECT_THROW(static_cast<void>(project(curves, Eigen::VectorXf::Zero(3), RowMatrix<float>::Zero(4, 2))), Error);
  EXPECT_THROW(static_cast<void>(reconstruct(curves, mean, RowMatrix<float>::Zero(4, 2))), Error);
  EXPECT_THROW(static_cast<void>(keyframe_distances(curves, RowMatrix<float>::Zero(3, 5))), Error);
}

TEST(keyframe_distance, is_a_metric_up_to_rounding) {
  const RowMatrix<float> rows = RowMatrix<float>::Random(40, 9);
  const auto table = keyframe_distances(rows, rows);
  EXPECT_LT(table.diagonal().maxCoeff(), 3e-3);  // the root of float's rounding
  EXPECT_LT((table - table.transpose()).cwiseAbs().maxCoeff(), 3e-3);
  EXPECT_GE(table.minCoeff(), 0);
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) EXPECT_LE(table(i, j), table(i, 7) + table(7, j) + 1e-5);
  }
}

}  // namespace
}  // namespace kinespace
