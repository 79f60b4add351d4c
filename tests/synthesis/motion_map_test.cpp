#include "kinespace/synthesis/motion_map.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

// Points of a plane in many dimensions: x along `u`, y along `v`, and some noise.
RetrievalMatrix in_a_plane(int clips, int dimensions, double noise) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  RetrievalMatrix out{.dimensions = static_cast<std::size_t>(dimensions)};
  for (int i = 0; i < clips; ++i) {
    out.clip_ids.push_back(10 + i);
    const double x = 5 * std::cos(i * 0.7);
    const double y = 2 * std::sin(i * 1.1);
    for (int d = 0; d < dimensions; ++d) {
      const double u = d == 1 ? -1 : 0;
      const double v = d == 3 ? -1 : 0;
      out.values.push_back(static_cast<float>(100 + x * u + y * v + noise * normal(generator)));
    }
  }
  return out;
}

double distance(const MapPoint& a, const MapPoint& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

double vector_distance(const RetrievalMatrix& m, std::size_t a, std::size_t b) {
  double sum = 0;
  for (std::size_t d = 0; d < m.dimensions; ++d) {
    sum += std::pow(double{m.values[a * m.dimensions + d]} - double{m.values[b * m.dimensions + d]}, 2);
  }
  return std::sqrt(sum);
}

TEST(MotionMap, points_of_a_plane_keep_their_distances_whether_clips_or_dimensions_are_fewer) {
  for (const auto& [clips, dimensions] : {std::pair{40, 8}, std::pair{6, 50}}) {
    const RetrievalMatrix vectors = in_a_plane(clips, dimensions, 0);
    const MotionMap map = motion_map(vectors);
    ASSERT_EQ(map.points.size(), vectors.clip_ids.size());
    EXPECT_NEAR(map.shares[0] + map.shares[1], 1, 1e-6);
    EXPECT_GT(map.shares[0], map.shares[1]);
    for (std::size_t i = 1; i < map.points.size(); ++i) {
      EXPECT_EQ(map.points[i].clip_id, vectors.clip_ids[i]);
      EXPECT_NEAR(distance(map.points[0], map.points[i]), vector_distance(vectors, 0, i), 1e-4);
    }
  }
}

TEST(MotionMap, noise_outside_the_plane_only_shortens_distances) {
  const RetrievalMatrix vectors = in_a_plane(30, 12, 0.3);
  const MotionMap map = motion_map(vectors);
  EXPECT_LT(map.shares[0] + map.shares[1], 0.999);
  for (std::size_t i = 1; i < map.points.size(); ++i) {
    EXPECT_LE(distance(map.points[0], map.points[i]), vector_distance(vectors, 0, i) + 1e-6);
  }
}

TEST(MotionMap, signs_do_not_depend_on_those_of_the_eigenvectors) {
  const RetrievalMatrix vectors = in_a_plane(40, 8, 0);
  const MotionMap map = motion_map(vectors);
  // The axes point along +d1 and +d3, whatever LAPACK says: where entry 1 is above its mean, x is positive.
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const double mean = -5 * std::cos(static_cast<double>(i) * 0.7);
    if (std::abs(mean) > 1) {
      EXPECT_GT(map.points[i].x * mean, 0) << i;
    }
  }
}

TEST(MotionMap, few_clips_and_clips_that_are_alike_have_a_place) {
  EXPECT_TRUE(motion_map({}).points.empty());
  const MotionMap one = motion_map({.clip_ids = {3}, .dimensions = 2, .values = {1, 2}});
  ASSERT_EQ(one.points.size(), 1U);
  EXPECT_EQ(one.points[0].x, 0);
  EXPECT_EQ(one.shares[0], 0);
  const MotionMap alike = motion_map({.clip_ids = {1, 2, 3}, .dimensions = 2, .values = {4, 5, 4, 5, 4, 5}});
  for (const MapPoint& p : alike.points) EXPECT_TRUE(p.x == 0 && p.y == 0);
}

}  // namespace
}  // namespace kinespace
