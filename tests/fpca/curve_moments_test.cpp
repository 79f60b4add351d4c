#include "kinespace/fpca/curve_moments.h"

#include <limits>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/fpca/sample_curves.h"

namespace kinespace {
namespace {

CurveMoments moments_of(const CurveView& curves) {
  CurveMoments out(static_cast<int>(curves.cols()));
  out.add(curves);
  return out;
}

double relative_gap(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

void expect_close(const CurveMoments& a, const CurveMoments& b, double tolerance) {
  EXPECT_EQ(a.count(), b.count());
  EXPECT_LE(relative_gap(a.mean(), b.mean()), tolerance);
  EXPECT_LE(relative_gap(a.scatter(), b.scatter()), tolerance);
}

TEST(CurveMoments, equal_the_definition) {
  const CurveMatrix y = test::sample_curves(1500, 37, 0.1);  // more than one block
  const CurveMoments m = moments_of(y);
  const Eigen::RowVectorXd mean = y.colwise().mean();
  const Eigen::MatrixXd centred = y.rowwise() - mean;
  EXPECT_EQ(m.count(), 1500);
  EXPECT_LE(relative_gap(m.mean(), mean.transpose()), 1e-13);
  EXPECT_LE(relative_gap(m.scatter(), centred.transpose() * centred), 1e-12);
  EXPECT_EQ(m.scatter(), m.scatter().transpose());
}

TEST(CurveMoments, of_two_halves_merged_equal_those_of_all) {
  for (const double offset : {0.0, 1e5}) {
    CurveMatrix y = test::sample_curves(2001, 50, 0.1);
    y.array() += offset;
    CurveMoments merged = moments_of(y.topRows(1000));
    merged.merge(moments_of(y.bottomRows(1001)));
    expect_close(merged, moments_of(y), 1e-10);
  }
}

TEST(CurveMoments, do_not_lose_digits_to_a_distant_mean) {
  const CurveMatrix y = test::sample_curves(3000, 20);
  CurveMatrix shifted = y;
  shifted.array() += 4096;  // exact but for the last bits of the values
  EXPECT_LE(relative_gap(moments_of(shifted).scatter(), moments_of(y).scatter()), 1e-11);
}

TEST(CurveMoments, do_not_depend_on_the_order_of_curves_or_the_size_of_blocks) {
  const CurveMatrix y = test::sample_curves(700, 30, 0.1);
  const CurveMatrix reversed = y.colwise().reverse();
  CurveMoments one_by_one(30);
  for (Eigen::Index i = 0; i < y.rows(); ++i) one_by_one.add(y.row(i));
  expect_close(moments_of(reversed), moments_of(y), 1e-12);
  expect_close(one_by_one, moments_of(y), 1e-12);
}

TEST(CurveMoments, merge_in_any_grouping) {
  const CurveMatrix y = test::sample_curves(90, 12, 0.1);
  const CurveMoments a = moments_of(y.topRows(5)), b = moments_of(y.middleRows(5, 60)),
                     c = moments_of(y.bottomRows(25));
  CurveMoments left = a, right = c;
  left.merge(b);
  left.merge(c);
  right.merge(b);
  right.merge(a);
  expect_close(left, right, 1e-12);
}

TEST(CurveMoments, merged_with_none_stay_as_they_are) {
  const CurveMoments some = moments_of(test::sample_curves(9, 8));
  CurveMoments a = some, b(8);
  a.merge(CurveMoments(8));
  b.merge(some);
  for (const CurveMoments& m : {a, b}) {
    EXPECT_EQ(m.count(), 9);
    EXPECT_EQ(m.mean(), some.mean());
    EXPECT_EQ(m.scatter(), some.scatter());
  }
}

TEST(CurveMoments, added_block_by_block_equal_those_of_one_matrix) {
  const CurveMatrix wide = test::sample_curves(400, 64, 0.1);
  CurveMoments strided(20);
  strided.add(wide.block(0, 10, 150, 20));  // rows that do not touch
  strided.add(wide.block(150, 10, 250, 20));
  strided.add(wide.block(0, 10, 0, 20));
  expect_close(strided, moments_of(CurveMatrix(wide.middleCols(10, 20))), 1e-12);
}

TEST(CurveMoments, survive_a_way_through_their_parts) {
  const CurveMoments m = moments_of(test::sample_curves(40, 9, 0.1));
  const CurveMoments again(m.count(), m.mean(), m.scatter());
  EXPECT_EQ(again.scatter(), m.scatter());
  EXPECT_EQ(again.mean(), m.mean());
  EXPECT_EQ(again.count(), m.count());
}

TEST(CurveMoments, have_the_same_bits_in_any_thread) {
  const CurveMatrix y = test::sample_curves(3000, 60, 0.1);
  const Eigen::MatrixXd alone = moments_of(y).scatter();
  std::vector<Eigen::MatrixXd> together(4);
  {
    std::vector<std::jthread> threads;
    threads.reserve(together.size());
    for (auto& out : together) threads.emplace_back([&] { out = moments_of(y).scatter(); });
  }
  for (const auto& scatter : together) EXPECT_EQ(scatter, alone);
}

TEST(CurveMoments, name_the_value_that_is_not_finite_and_keep_what_they_had) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CurveMatrix y = test::sample_curves(600, 50);
    CurveMoments m = moments_of(y);
    const Eigen::MatrixXd before = m.scatter();
    y(512, 3) = bad;
    try {
      m.add(y);
      FAIL() << "took " << bad;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::bad_input);
      EXPECT_THAT(e.what(), ::testing::HasSubstr("curve 513 at point 4"));
    }
    EXPECT_EQ(m.count(), 600);
    EXPECT_EQ(m.scatter(), before);
  }
}

TEST(CurveMoments, refuse_values_whose_squares_overflow) {
  CurveMatrix y = CurveMatrix::Zero(2, 3);
  y(0, 1) = 1e200;
  CurveMoments m(3);
  EXPECT_THROW(m.add(y), Error);
  EXPECT_EQ(m.count(), 0);
}

TEST(CurveMoments, refuse_other_lengths) {
  CurveMoments m(5);
  EXPECT_THROW(m.add(CurveMatrix::Zero(2, 4)), Error);
  EXPECT_THROW(m.merge(CurveMoments(4)), Error);
  EXPECT_THROW(CurveMoments(0), Error);
  EXPECT_THROW(CurveMoments(1, Eigen::VectorXd::Zero(3), Eigen::MatrixXd::Zero(3, 2)), Error);
}

}  // namespace
}  // namespace kinespace
