// Segmentation, grouping and group spaces of the repeated motion analysis.
#include "kinespace/repeats/grouping.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/repeats/group_space.h"
#include "kinespace/repeats/segmentation.h"
#include "tests/repeats/sample_tables.h"

namespace kinespace {
namespace {

using test::add_clip;
using test::Cycle;
using test::empty_table;

constexpr double rate = 60;

// 8 s of one behaviour, then 8 s of another, in one clip.
FrameTable two_behaviours() {
  FrameTable out = empty_table(12, rate);
  const Cycle a(12, 0), b(12, 1);
  add_clip(out, 960, [&](double t) { return t < 480 ? a(t / 61) : b(t / 47); });
  return out;
}

void expect_cover(const std::vector<FrameSpan>& segments, const FrameTable& table) {
  std::int64_t at = 0;
  for (const FrameSpan& segment : segments) {
    EXPECT_EQ(segment.first, at);
    EXPECT_GT(segment.last, segment.first);
    at = segment.last;
  }
  EXPECT_EQ(at, table.frames);
  for (const std::int64_t start : table.starts) {
    EXPECT_THAT(segments, testing::Contains(testing::Field(&FrameSpan::first, start)));
  }
}

TEST(rma_segmentation, a_change_of_behaviour_is_cut_where_it_is) {
  const FrameTable table = two_behaviours();
  const std::vector<FrameSpan> segments = behaviour_segments(table);
  expect_cover(segments, table);
  EXPECT_THAT(segments, testing::Contains(testing::Field(
                            &FrameSpan::first, testing::AllOf(testing::Gt(480 - 20), testing::Lt(480 + 20)))));
  EXPECT_LE(segments.size(), 4U);
}

TEST(rma_segmentation, one_behaviour_is_one_segment) {
  FrameTable table = empty_table(12, rate);
  const Cycle walk(12, 0);
  add_clip(table, 1200, [&](double t) { return walk(t / 61); });
  EXPECT_EQ(behaviour_segments(table).size(), 1U);
}

TEST(rma_segmentation, lengths_are_in_seconds) {
  FrameTable slow = empty_table(12, rate), fast = empty_table(12, 4 * rate);
  const Cycle a(12, 0), b(12, 1);
  add_clip(slow, 960, [&](double t) { return t < 480 ? a(t / 61) : b(t / 47); });
  add_clip(fast, 3840, [&](double t) { return t < 1920 ? a(t / 244) : b(t / 188); });
  const auto few = behaviour_segments(slow), many = behaviour_segments(fast);
  ASSERT_EQ(few.size(), many.size());
  for (std::size_t s = 0; s < few.size(); ++s) {
    EXPECT_NEAR(static_cast<double>(few[s].first) / rate, static_cast<double>(many[s].first) / (4 * rate), 0.11);
  }
}

TEST(rma_segmentation, every_clip_begins_a_segment_however_short_it_is) {
  FrameTable table = empty_table(12, rate);
  const Cycle walk(12, 0);
  for (const int frames : {1, 10, 400, 2, 59}) add_clip(table, frames, [&](double t) { return walk(t / 61); });
  expect_cover(behaviour_segments(table), table);
}

TEST(rma_segmentation, a_held_pose_is_one_segment) {
  FrameTable table = empty_table(12, rate);
  add_clip(table, 900, [](double /*t*/) { return Eigen::VectorXd::Constant(12, 7.5); });
  EXPECT_EQ(behaviour_segments(table).size(), 1U);
}

TEST(rma_grouping, segments_of_one_behaviour_meet_in_one_group) {
  FrameTable table = empty_table(12, rate);
  const Cycle a(12, 0), b(12, 1);
  std::vector<FrameSpan> segments;
  const std::vector<int> behaviour{0, 1, 1, 0, 1, 0, 0, 1};
  for (const int which : behaviour) {
    add_clip(table, 600, [&](double t) { return which == 0 ? a(t / 61) : b(t / 47); });
    segments.push_back({table.frames - 600, table.frames});
  }
  const SegmentGrouping grouping = group_segments(table, segments);
  EXPECT_EQ(grouping.groups, 2);
  EXPECT_EQ(grouping.group, behaviour);
  EXPECT_THAT(grouping.ranges(1, table), testing::ElementsAre(segments[1], segments[2], segments[4], segments[7]));
}

TEST(rma_grouping, two_groups_that_need_the_same_axes_are_one) {
  FrameTable table = empty_table(12, rate);
  const Cycle walk(12, 0);
  std::vector<FrameSpan> segments;
  for (int s = 0; s < 6; ++s) {
    add_clip(table, 300 + s, [&](double t) { return walk((t + 10 * s) / (55 + s)); });
    segments.push_back({table.starts.back(), table.frames});
  }
  EXPECT_EQ(group_segments(table, segments).groups, 1);
}

TEST(rma_grouping, ranges_join_neighbours_of_a_clip_and_stop_at_starts) {
  FrameTable table = empty_table(2, rate);
  for (int c = 0; c < 2; ++c) add_clip(table, 100, [](double t) { return Eigen::VectorXd::Constant(2, t); });
  const SegmentGrouping grouping{
      .segments = {{0, 40}, {40, 100}, {100, 130}, {130, 200}}, .group = {0, 0, 0, 1}, .groups = 2};
  EXPECT_THAT(grouping.ranges(0, table), testing::ElementsAre(FrameSpan{0, 100}, FrameSpan{100, 130}));
}

class rma_group_space : public testing::Test {
 protected:
  FrameTable table_ = two_behaviours();
  FrameSpan range_{100, 700};

  // The mean squared distance of the frames to the space.
  double residual(const GroupSpace& space) const {
    const Eigen::MatrixXd back = space.reconstruct(space.project(table_, std::span(&range_, 1)).cast<double>());
    double sum = 0;
    for (std::int64_t f = range_.first; f < range_.last; ++f) {
      const auto frame = table_.frame(f);
      const Eigen::Map<const Eigen::VectorXf> x(frame.data(), static_cast<Eigen::Index>(frame.size()));
      sum += (back.col(f - range_.first) - x.cast<double>()).squaredNorm();
    }
    return sum / static_cast<double>(range_.frames());
  }
};

TEST_F(rma_group_space, axes_are_orthonormal_and_in_order_of_variance) {
  const GroupSpace space = fit_group_space(table_, std::span(&range_, 1), {.axes = 6});
  EXPECT_LT((space.axes.transpose() * space.axes - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-12);
  for (Eigen::Index a = 1; a < 6; ++a) EXPECT_LE(space.variances(a), space.variances(a - 1));
}

TEST_F(rma_group_space, what_is_left_out_is_what_reconstruction_misses) {
  const GroupSpace space = fit_group_space(table_, std::span(&range_, 1), {.axes = 3});
  EXPECT_NEAR(residual(space), space.total_variance - space.variances.sum(), 1e-3);
}

TEST_F(rma_group_space, the_fewest_axes_that_keep_the_share) {
  for (const double share : {0.5, 0.9, 0.95, 0.98}) {
    const GroupSpace space = fit_group_space(table_, std::span(&range_, 1), {.variance = share});
    EXPECT_GE(space.variances.sum(), share * space.total_variance);
    EXPECT_LT(space.variances.sum() - space.variances.tail(1)(0), share * space.total_variance);
  }
}

TEST_F(rma_group_space, the_fewest_axes_that_leave_no_more_than_asked) {
  const GroupSpace space = fit_group_space(table_, std::span(&range_, 1), {.residual = 40});
  EXPECT_LE(residual(space), 40.01);
  EXPECT_GT(residual(space) + space.variances.tail(1)(0), 40);
}

TEST_F(rma_group_space, a_held_pose_has_one_axis_and_no_variance) {
  FrameTable held = empty_table(5, rate);
  add_clip(held, 50, [](double /*t*/) { return Eigen::VectorXd::Constant(5, -3); });
  const FrameSpan all{0, 50};
  const GroupSpace space = fit_group_space(held, std::span(&all, 1));
  EXPECT_EQ(space.axis_count(), 1);
  EXPECT_NEAR(space.total_variance, 0, 1e-9);
  EXPECT_NEAR(space.mean(4), -3, 1e-12);
}

TEST_F(rma_group_space, no_frames_are_an_error) {
  EXPECT_THROW(static_cast<void>(fit_group_space(table_, {})), Error);
}

TEST(rma_frame_table, what_does_not_fit_together_is_named) {
  FrameTable table = two_behaviours();
  table.values.pop_back();
  EXPECT_THROW(table.validate(), Error);
  table = two_behaviours();
  table.starts = {0, 400, 400};
  EXPECT_THROW(table.validate(), Error);
  table = two_behaviours();
  table.values[5000] = std::numeric_limits<float>::quiet_NaN();
  try {
    table.validate();
    FAIL() << "a number that is none was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), testing::HasSubstr("416"));
  }
}

}  // namespace
}  // namespace kinespace
