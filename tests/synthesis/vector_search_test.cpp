#include "kinespace/synthesis/vector_search.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

using Rows = RowMatrix<float>;

std::span<const float> row_of(const Rows& rows, Eigen::Index i) {
  return {rows.data() + i * rows.cols(), static_cast<std::size_t>(rows.cols())};
}

Rows random_rows(Eigen::Index rows, Eigen::Index dimensions, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<float> normal;
  return Rows::NullaryExpr(rows, dimensions, [&] { return normal(generator); });
}

// Clusters of very different spread, far from the origin, with correlated dimensions.
Rows clustered_rows(Eigen::Index rows, Eigen::Index dimensions, unsigned seed) {
  const Rows centres = random_rows(9, dimensions, seed + 1) * 3;
  const Rows mix = random_rows(dimensions, dimensions, seed + 2) / std::sqrt(static_cast<float>(dimensions));
  Rows out = random_rows(rows, dimensions, seed) * mix;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index c = i % centres.rows();
    out.row(i) = out.row(i) * std::pow(0.3F, static_cast<float>(c)) + centres.row(c);
    out.row(i).array() += 100;
  }
  return out;
}

// Both the turned and the plain index give what comparing with all gives, bit for bit, for queries from among the rows
// and from elsewhere.
void expect_exact(const Rows& rows, const Rows& queries, int k, const std::vector<float>& weights = {},
                  const std::vector<std::uint8_t>& allowed = {}) {
  for (const bool rotate : {true, false}) {
    const VectorSearch search(rows, {.rotate = rotate, .weights = weights});
    VectorSearch::Scratch scratch;
    const auto ask = [&](std::span<const float> query) {
      const auto found = search.nearest(query, k, scratch, allowed);
      const auto wanted = reference::nearest(rows, query, k, weights, allowed);
      ASSERT_EQ(found.size(), wanted.size());
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        ASSERT_EQ(found[i].row, wanted[i].row) << "at " << i << " of " << k << ", turned " << rotate;
        ASSERT_EQ(found[i].squared, wanted[i].squared);
      }
    };
    for (Eigen::Index q = 0; q < queries.rows(); ++q) ask(row_of(queries, q));
    for (Eigen::Index q = 0; q < rows.rows(); q += 1 + rows.rows() / 7) ask(row_of(rows, q));
  }
}

TEST(VectorSearch, random_rows_are_searched_exactly) {
  for (const Eigen::Index dimensions : {1, 2, 15, 16, 17, 24, 25, 33, 100, 256}) {
    expect_exact(random_rows(700, dimensions, 1), random_rows(5, dimensions, 2), 10);
  }
}

TEST(VectorSearch, every_number_of_rows_is_searched_exactly) {
  for (const Eigen::Index rows : {1, 2, 15, 16, 17, 31, 32, 33, 255, 256, 257, 4097}) {
    expect_exact(random_rows(rows, 20, 3), random_rows(3, 20, 4), 10);
  }
}

TEST(VectorSearch, clusters_far_from_the_origin_are_searched_exactly) {
  expect_exact(clustered_rows(5000, 64, 5), clustered_rows(20, 64, 6), 10);
}

TEST(VectorSearch, equal_distances_go_to_the_lower_row) {
  Rows rows = clustered_rows(600, 40, 7);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = Rows(rows.row(i % 60));
  expect_exact(rows, clustered_rows(5, 40, 8), 25);
  const VectorSearch search(rows);
  const auto found = search.nearest(row_of(rows, 75), 10);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(found[i].row, 15 + 60 * static_cast<std::int64_t>(i));
    EXPECT_EQ(found[i].squared, 0);
  }
}

// Steps of one unit in the last place: what float sums cannot tell apart, the list still orders.
TEST(VectorSearch, near_ties_are_ordered_by_their_exact_distances) {
  const Eigen::Index dimensions = 48;
  const Rows base = random_rows(1, dimensions, 9);
  std::mt19937 generator(10);
  Rows rows(400, dimensions);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) = base;
    float& one = rows(i, static_cast<Eigen::Index>(generator() % static_cast<unsigned>(dimensions)));
    one = std::nextafter(one, generator() % 2 == 0 ? 1e9F : -1e9F);
  }
  expect_exact(rows, random_rows(5, dimensions, 11), 50);
}

TEST(VectorSearch, constant_rows_and_zeros_are_searched_exactly) {
  expect_exact(Rows::Constant(100, 30, 3.25F), random_rows(3, 30, 12), 10);
  expect_exact(Rows::Zero(100, 30), Rows::Zero(1, 30), 10);
}

TEST(VectorSearch, very_large_and_very_small_numbers_are_searched_exactly) {
  expect_exact(random_rows(300, 30, 13) * 1e11F, random_rows(3, 30, 14) * 1e11F, 10);
  expect_exact(random_rows(300, 30, 13) * 1e-25F, random_rows(3, 30, 14) * 1e-25F, 10);
}

TEST(VectorSearch, more_than_there_are_gives_all) {
  const Rows rows = random_rows(37, 20, 15);
  expect_exact(rows, random_rows(2, 20, 16), 1000);
  EXPECT_EQ(VectorSearch(rows).nearest(row_of(rows, 0), 1000).size(), 37U);
  EXPECT_TRUE(VectorSearch(Rows(0, 20)).nearest(row_of(rows, 0), 5).empty());
}

TEST(VectorSearch, weights_are_those_of_the_distance) {
  const Rows rows = clustered_rows(2000, 50, 17);
  std::vector<float> weights(50);
  for (std::size_t d = 0; d < weights.size(); ++d) weights[d] = static_cast<float>(d % 5) * 0.7F;
  expect_exact(rows, clustered_rows(10, 50, 18), 10, weights);
  // By hand: only the first dimension counts.
  std::vector<float> first(50, 0.0F);
  first[0] = 2;
  const auto found = VectorSearch(rows, {.weights = first}).nearest(row_of(rows, 3), 2);
  EXPECT_EQ(found[0].row, 3);
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (i != 3) least = std::min(least, std::abs(static_cast<double>(rows(i, 0)) - static_cast<double>(rows(3, 0))));
  }
  EXPECT_NEAR(std::sqrt(found[1].squared), 2 * least, 1e-5);
}

TEST(VectorSearch, only_allowed_rows_are_found) {
  const Rows rows = clustered_rows(3000, 40, 19);
  std::mt19937 generator(20);
  for (const unsigned one_in : {2U, 50U, 2000U}) {
    std::vector<std::uint8_t> allowed(3000);
    for (auto& a : allowed) a = generator() % one_in == 0 ? 1 : 0;
    expect_exact(rows, clustered_rows(5, 40, 21), 10, {}, allowed);
  }
  const std::vector<std::uint8_t> none(3000, 0);
  EXPECT_TRUE(VectorSearch(rows).nearest(row_of(rows, 0), 10, none).empty());
}

TEST(VectorSearch, what_does_not_fit_is_refused) {
  const VectorSearch search(random_rows(10, 4, 22));
  const std::vector<float> query(4, 0.0F);
  EXPECT_THROW(static_cast<void>(search.nearest(query, 0)), Error);
  EXPECT_THROW(static_cast<void>(search.nearest(std::span(query).first(3), 1)), Error);
  EXPECT_THROW(static_cast<void>(search.nearest(query, 1, std::vector<std::uint8_t>(9, 1))), Error);
  EXPECT_THROW(VectorSearch(Rows(3, 0)), Error);
  EXPECT_THROW(VectorSearch(random_rows(10, 4, 23), {.weights = {1, 2}}), Error);
  EXPECT_THROW(VectorSearch(random_rows(10, 4, 23), {.weights = {1, 2, -1, 1}}), Error);
  Rows broken = random_rows(10, 4, 24);
  broken(7, 2) = std::numeric_limits<float>::quiet_NaN();
  try {
    const VectorSearch refused(broken);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("row 7, dimension 2"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kinespace
