// Self-distance tables and the similar-posture paths in them.
#include "kinespace/repeats/posture_paths.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/repeats/self_distance.h"
#include "tests/repeats/sample_tables.h"

namespace kinespace {
namespace {

using test::add_clip;
using test::Cycle;
using test::empty_table;

constexpr double path_rate = 30;

struct Group {
  FrameTable table;
  std::vector<FrameSpan> ranges;
  GroupSpace space;

  explicit Group(FrameTable frames) : table(std::move(frames)) {
    for (std::size_t c = 0; c < table.starts.size(); ++c) {
      ranges.push_back({table.starts[c], c + 1 < table.starts.size() ? table.starts[c + 1] : table.frames});
    }
    space = fit_group_space(table, ranges, {.variance = 0.999});
  }
  [[nodiscard]] SelfDistance distances(int stride = 1) const { return {space, table, ranges, stride}; }
};

// The phase of a walk whose pace comes and goes: 20 to 40 frames a cycle.
double warped(double t) {
  return t / 28 + 0.5 * std::sin(t / 40);
}

FrameTable walk_with_changing_pace() {
  FrameTable out = empty_table(10, path_rate);
  const Cycle walk(10, 0);
  add_clip(out, 300, [&](double t) { return walk(warped(t)); });
  return out;
}

TEST(rma_self_distance, is_the_distance_in_the_group_s_space) {
  const Group group(walk_with_changing_pace());
  const SelfDistance distances = group.distances();
  const Eigen::MatrixXf x = group.space.project(group.table, group.ranges);
  SelfDistance::Tile tile(7, 9);
  distances.tile(20, 100, tile);
  for (int r = 0; r < 7; ++r) {
    for (int c = 0; c < 9; ++c) {
      const float wanted = std::max((x.col(20 + r) - x.col(100 + c)).norm(), static_cast<float>(distances.floor()));
      EXPECT_NEAR(distances.at(20 + r, 100 + c), wanted, 1e-3);
      EXPECT_NEAR(std::sqrt(tile(r, c)), wanted, 1e-2);
    }
  }
}

TEST(rma_self_distance, the_typical_distance_is_the_mean_square_over_all_pairs) {
  const Group group(walk_with_changing_pace());
  const SelfDistance distances = group.distances();
  double sum = 0;
  for (int i = 0; i < 300; ++i) {
    for (int j = 0; j < 300; ++j) sum += i == j ? 0 : std::pow(static_cast<double>(distances.at(i, j)), 2);
  }
  EXPECT_NEAR(distances.typical(), std::sqrt(sum) / 300, 0.01);
}

TEST(rma_self_distance, a_gap_between_clips_is_far_from_everything_and_pixels_know_their_frames) {
  FrameTable table = walk_with_changing_pace();
  const Cycle walk(10, 0);
  add_clip(table, 31, [&](double t) { return walk(warped(t)); });
  const Group group(std::move(table));
  const SelfDistance distances = group.distances(4);
  EXPECT_EQ(distances.size(), 75 + 1 + 8);
  EXPECT_TRUE(distances.is_gap(75));
  EXPECT_EQ(distances.frame(74, 0), 296);
  EXPECT_EQ(distances.frame(75, 0), 300);
  EXPECT_EQ(distances.frame(76, 1), 300);
  EXPECT_EQ(distances.frame(84, 1), 331);
  SelfDistance::Tile tile(3, 1);
  distances.tile(10, 75, tile);
  EXPECT_GT(tile.minCoeff(), 1e20F);
}

TEST(rma_paths, follow_equal_phases_of_a_walk_whose_pace_changes) {
  const Group group(walk_with_changing_pace());
  const SelfDistance distances = group.distances();
  const std::vector<PosturePath> paths = find_posture_paths(distances, {.threshold = 0.3});
  ASSERT_FALSE(paths.empty());
  // Frames that equal postures join: for every frame, one in each later cycle.
  std::size_t wanted = 0, points = 0;
  for (int i = 0; i < 300; ++i) wanted += static_cast<std::size_t>(std::floor(warped(299) - warped(i)));
  for (const PosturePath& path : paths) {
    for (const PathPoint& point : path.points) {
      const double apart = warped(point.j) - warped(point.i);
      EXPECT_NEAR(apart, std::round(apart), 0.08) << point.i << " " << point.j;
      EXPECT_NEAR(point.distance, distances.at(point.i, point.j), 1e-2);
    }
    points += path.points.size();
  }
  EXPECT_GT(static_cast<double>(points), 0.95 * static_cast<double>(wanted));
}

TEST(rma_paths, never_fall_and_never_cross_from_clip_to_clip) {
  FrameTable table = walk_with_changing_pace();
  const Cycle walk(10, 0);
  add_clip(table, 200, [&](double t) { return walk(warped(t + 300)); });
  const Group group(std::move(table));
  const SelfDistance distances = group.distances();
  const std::vector<PosturePath> paths = find_posture_paths(distances);
  ASSERT_FALSE(paths.empty());
  for (const PosturePath& path : paths) {
    for (std::size_t p = 0; p < path.points.size(); ++p) {
      EXPECT_LT(path.points[p].i, path.points[p].j);
      EXPECT_EQ(distances.run(path.points[p].i), distances.run(path.points.front().i));
      EXPECT_EQ(distances.run(path.points[p].j), distances.run(path.points.front().j));
      if (p == 0) continue;
      EXPECT_GE(path.points[p].i, path.points[p - 1].i);
      EXPECT_GE(path.points[p].j, path.points[p - 1].j);
      EXPECT_LE(path.points[p].i - path.points[p - 1].i, 2);
      EXPECT_LE(path.points[p].j - path.points[p - 1].j, 2);
    }
  }
}

// Two walks of 120 frames; in the second, frames 50 to 50 + disturbed are elsewhere.
std::size_t paths_with_disturbance(int disturbed) {
  FrameTable table = empty_table(10, path_rate);
  const Cycle walk(10, 0), other(10, 1);
  add_clip(table, 120, [&](double t) { return walk(t / 130); });
  add_clip(table, 120, [&](double t) { return t >= 50 && t < 50 + disturbed ? other(t / 50) : walk(t / 130); });
  const Group group(std::move(table));
  return find_posture_paths(group.distances(), {.threshold = 0.3}).size();
}

TEST(rma_paths, a_short_bridge_joins_two_paths_and_a_long_one_does_not) {
  EXPECT_EQ(paths_with_disturbance(0), 1U);
  EXPECT_EQ(paths_with_disturbance(3), 1U);
  EXPECT_EQ(paths_with_disturbance(15), 2U);
}

TEST(rma_paths, short_paths_are_dropped) {
  FrameTable table = empty_table(10, path_rate);
  const Cycle walk(10, 0), other(10, 1);
  add_clip(table, 120, [&](double t) { return walk(t / 130); });
  add_clip(table, 120, [&](double t) { return t < 12 ? walk((t + 40) / 130) : other(t / 130); });
  const Group group(std::move(table));
  const auto count = [&](double length_s) {
    return find_posture_paths(group.distances(), {.threshold = 0.2, .length_s = length_s}).size();
  };
  EXPECT_EQ(count(0.5), 1U);  // 12 + 12 pixels at 30 Hz are 0.73 s
  EXPECT_EQ(count(1.4), 0U);
}

TEST(rma_paths, a_motion_that_never_comes_back_has_none) {
  FrameTable table = empty_table(10, path_rate);
  add_clip(table, 600, [](double t) { return test::one_way(10, t); });
  const Group group(std::move(table));
  EXPECT_TRUE(find_posture_paths(group.distances(), {.threshold = 0.05, .lag_s = 2}).empty());
}

TEST(rma_paths, a_held_pose_has_no_valleys) {
  FrameTable table = empty_table(10, path_rate);
  add_clip(table, 300, [](double /*t*/) { return Eigen::VectorXd::Constant(10, 4); });
  const Group group(std::move(table));
  EXPECT_TRUE(find_posture_paths(group.distances()).empty());
}

TEST(rma_paths, crowds_are_thinned) {
  FrameTable table = empty_table(10, path_rate);
  const Cycle walk(10, 0);
  add_clip(table, 2400, [&](double t) { return walk(t / 24); });
  const Group group(std::move(table));
  const auto all = find_posture_paths(group.distances(), {.crowd = 1000});
  const auto some = find_posture_paths(group.distances(), {.crowd = 10});
  EXPECT_EQ(all.size(), 99U);
  EXPECT_LT(some.size(), 30U);
  EXPECT_GE(some.size(), 5U);
}

}  // namespace
}  // namespace kinespace
