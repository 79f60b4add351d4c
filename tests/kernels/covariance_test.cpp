#include "kinespace/kernels/covariance.h"

#include <cmath>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// Curves with a trend, far from 0.
RowMatrix<float> curves(int count, int points, unsigned seed) {
  std::srand(seed);
  RowMatrix<float> out = RowMatrix<float>::Random(count, points);
  for (int t = 1; t < points; ++t) out.col(t) += out.col(t - 1);
  out.array() += 50;
  return out;
}

double difference(const CurveCovariance& a, const CurveCovariance& b) {
  EXPECT_EQ(a.count, b.count);
  return std::max((a.mean - b.mean).cwiseAbs().maxCoeff() / b.mean.cwiseAbs().maxCoeff(),
                  (a.covariance - b.covariance).cwiseAbs().maxCoeff() / b.covariance.cwiseAbs().maxCoeff());
}

TEST(covariance, two_halves_merge_to_the_whole) {
  const auto all = curves(5001, 37, 1);
  for (const int cut : {1, 700, 1024, 2500, 5000}) {
    CovarianceStream whole(37, BlockPrecision::double_precision);
    CovarianceStream first(37, BlockPrecision::double_precision);
    CovarianceStream second(37, BlockPrecision::double_precision);
    whole.add(all);
    first.add(all.topRows(cut));
    second.add(all.bottomRows(5001 - cut));
    first.merge(second);
    EXPECT_LT(difference(first.result(), whole.result()), 1e-12) << cut;
    EXPECT_LT(difference(whole.result(), reference::covariance(all)), 1e-10);
  }
}

TEST(covariance, merging_with_nothing_changes_nothing) {
  CovarianceStream stream(9);
  CovarianceStream nothing(9);
  stream.add(curves(100, 9, 2));
  const auto before = stream.result();
  stream.merge(nothing);
  EXPECT_EQ(difference(stream.result(), before), 0);
  nothing.merge(stream);
  EXPECT_LT(difference(nothing.result(), before), 1e-7);
}

TEST(covariance, does_not_depend_on_how_curves_are_divided) {
  const auto all = curves(3333, 20, 3);
  CovarianceStream whole(20);
  whole.add(all);
  for (const int step : {1, 100, 1024, 1500}) {
    CovarianceStream parts(20);
    for (int at = 0; at < 3333; at += step) parts.add(all.middleRows(at, std::min(step, 3333 - at)));
    EXPECT_EQ(difference(parts.result(), whole.result()), 0) << step;
  }
}

TEST(covariance, does_not_depend_on_threads) {
  const auto all = curves(20000, 33, 4);
  const auto several = covariance(all);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(difference(covariance(all), several), 0);
}

TEST(covariance, takes_rows_of_a_wider_matrix) {
  const auto all = curves(2100, 30, 5);
  const RowMatrix<float> part = all.middleCols(3, 20);
  EXPECT_EQ(difference(covariance(all.middleCols(3, 20)), covariance(part)), 0);
}

TEST(covariance, a_large_offset_costs_no_precision) {
  RowMatrix<float> all = curves(4000, 16, 6);
  all.array() = (all.array() * 64).round() / 64 + 1000;  // exact in float at both places
  RowMatrix<float> near = all;
  near.array() -= 1050;
  EXPECT_LT(difference({4000, Eigen::VectorXd::Ones(1), covariance(all).covariance},
                       {4000, Eigen::VectorXd::Ones(1), covariance(near).covariance}),
            3e-6);
}

TEST(covariance, of_too_few_curves_is_a_usage_error) {
  CovarianceStream stream(3);
  EXPECT_THROW(static_cast<void>(stream.result()), Error);
  stream.add(curves(1, 3, 7));
  EXPECT_THROW(static_cast<void>(stream.result(1)), Error);
  EXPECT_EQ(stream.result(0).covariance.cwiseAbs().maxCoeff(), 0);
  EXPECT_THROW(stream.add(curves(1, 4, 7)), Error);
  EXPECT_THROW(stream.merge(CovarianceStream(4)), Error);
  EXPECT_THROW(CovarianceStream(0), Error);
}

TEST(covariance, of_numbers_that_are_not_finite_is_bad_input) {
  auto all = curves(10, 3, 8);
  all(4, 1) = NAN;
  try {
    static_cast<void>(covariance(all));
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  }
}

}  // namespace
}  // namespace kinespace
