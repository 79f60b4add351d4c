#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/interpolation.h"
#include "kinespace/synthesis/motion_engine.h"
#include "kinespace/synthesis/transition_plan.h"
#include "tests/support/library_folder.h"

namespace kinespace {
namespace {

class Transitions : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::LibraryFolder>();
    static_cast<void>(folder_->build());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::unique_ptr<test::LibraryFolder> folder_;
  LibraryView view_{folder_->library()};
};
std::unique_ptr<test::LibraryFolder> Transitions::folder_;

const std::vector<std::string> walk_to_run{"walk_normal_001", "run_normal_001"};

TEST_F(Transitions, the_first_motion_is_played_as_it_is_until_the_overlap) {
  const auto plan = plan_transition(view_, walk_to_run);
  ASSERT_TRUE(plan);
  const Clip first = view_.clip(view_.require_clip(walk_to_run[0]));
  const int frames = static_cast<int>(plan->transition.begin[0] * first.rate_hz);
  EXPECT_LT(compare(slice(first, 0, frames), slice(plan->transition.clip, 0, frames)).max_joint_error_cm, 1e-6);
}

TEST_F(Transitions, the_second_motion_follows_as_it_is_but_for_where_it_stands) {
  const auto plan = plan_transition(view_, walk_to_run);
  ASSERT_TRUE(plan);
  const Clip& made = plan->transition.clip;
  const Clip second = view_.clip(view_.require_clip(walk_to_run[1]));
  const Join& join = plan->transition.joins[0];
  const int first_frame = static_cast<int>(std::ceil(join.connection.entered_s * second.rate_hz + 1e-6));
  const int count = second.frames - first_frame;
  ASSERT_GT(count, 10);
  const JointPositions a = joint_positions(slice(second, first_frame, count));
  const JointPositions b = joint_positions(slice(made, made.frames - count, count));
  // Distances between joints, and from frame to frame, do not depend on the place.
  for (int f = 0; f < count; ++f) {
    for (int j = 1; j < a.joints; ++j) {
      EXPECT_NEAR((a.at(f, j) - a.at(0, 0)).norm(), (b.at(f, j) - b.at(0, 0)).norm(), 1e-6);
      EXPECT_NEAR(a.at(f, j).y(), b.at(f, j).y(), 1e-6);
    }
  }
}

TEST_F(Transitions, seams_are_no_faster_and_no_more_sudden_than_the_motions) {
  const auto rows = view_.library().clips();
  std::vector<double> worst;
  for (std::size_t i = 0; i < rows.size(); i += 2) {
    const auto plan = plan_transition(view_, std::vector{rows[i].name, rows[(i * 5 + 3) % rows.size()].name});
    ASSERT_TRUE(plan);
    worst.push_back(plan->transition.joins[0].ratios.worst());
  }
  std::ranges::sort(worst);
  EXPECT_LE(worst[worst.size() / 2], 1.0);
  EXPECT_LE(worst.back(), 2.0);
}

TEST_F(Transitions, heights_of_the_ground_stay) {
  const auto plan = plan_transition(view_, std::vector<std::string>{"stand_calm_001", "walk_normal_001"});
  ASSERT_TRUE(plan);
  const JointPositions positions = joint_positions(plan->transition.clip);
  double lowest = 1e9;
  for (const auto& p : positions.values) lowest = std::min(lowest, p.y());
  EXPECT_GT(lowest, -3);
  EXPECT_LT(lowest, 4);
}

TEST_F(Transitions, a_clip_can_follow_itself) {
  const auto plan = plan_transition(view_, std::vector<std::string>{"walk_normal_001", "walk_normal_001"});
  ASSERT_TRUE(plan);
  const double once = view_.clip(view_.require_clip("walk_normal_001")).duration_s();
  EXPECT_GT(plan->transition.clip.duration_s(), 1.2 * once);
  EXPECT_LT(plan->transition.joins[0].connection.cost_cm, 12);
}

TEST_F(Transitions, three_clips_have_two_seams) {
  const auto plan =
      plan_transition(view_, std::vector<std::string>{"walk_normal_001", "run_normal_001", "walk_normal_001"});
  ASSERT_TRUE(plan);
  ASSERT_EQ(plan->transition.begin.size(), 2U);
  EXPECT_GT(plan->transition.begin[1], plan->transition.begin[0] + plan->transition.joins[0].duration_s - 1e-9);
}

TEST_F(Transitions, one_name_is_not_enough_and_unknown_names_are_told) {
  EXPECT_THROW(static_cast<void>(plan_transition(view_, std::vector<std::string>{"walk_normal_001"})), Error);
  EXPECT_THROW(static_cast<void>(plan_transition(view_, std::vector<std::string>{"walk_normal_001", "nothing"})),
               Error);
}

TEST_F(Transitions, a_path_through_the_graph_leads_from_the_first_clip_to_the_last) {
  TransitionPlanOptions options{.via_graph = true};
  const auto plan = plan_transition(view_, std::vector<std::string>{"stand_calm_001", "run_fast_001"}, options);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->clips.front(), "stand_calm_001");
  EXPECT_EQ(plan->clips.back(), "run_fast_001");
}

TEST_F(Transitions, a_blend_at_a_whole_number_is_that_clip) {
  const std::vector<std::string> names{"walk_normal_001", "walk_fast_001", "run_normal_001"};
  for (int at = 0; at < 3; ++at) {
    const Blend blend = make_blend(view_, names, {.at = at});
    const Clip clip = view_.clip(view_.require_clip(names[static_cast<std::size_t>(at)]));
    EXPECT_LT(compare(clip, blend.clip).max_joint_error_cm, 1e-6) << at;
  }
}

TEST_F(Transitions, weights_of_one_and_zero_are_that_clip) {
  const std::vector<std::string> names{"walk_normal_001", "walk_fast_001"};
  const Blend blend = make_blend(view_, names, {.weights = std::vector<double>{0, 2}});
  EXPECT_LT(compare(view_.clip(view_.require_clip(names[1])), blend.clip).max_joint_error_cm, 1e-6);
}

TEST_F(Transitions, a_blend_along_the_curve_begins_and_ends_as_its_clips) {
  const std::vector<std::string> names{"walk_normal_001", "walk_fast_001"};
  const Blend blend = make_blend(view_, names);
  const Clip first = view_.clip(view_.require_clip(names[0]));
  EXPECT_LT(compare(slice(first, 0, 1), slice(blend.clip, 0, 1)).max_joint_error_cm, 1e-6);
  EXPECT_LE(blend.ratios.worst(), 2);
}

TEST_F(Transitions, half_way_between_two_walks_is_as_fast_as_between_them) {
  const auto speed = [](const Clip& clip) {
    const JointPositions p = joint_positions(clip);
    return (p.at(clip.frames - 1, 0) - p.at(0, 0)).norm() / clip.duration_s();
  };
  const std::vector<std::string> names{"walk_slow_001", "walk_fast_001"};
  const double slow = speed(view_.clip(view_.require_clip(names[0])));
  const double fast = speed(view_.clip(view_.require_clip(names[1])));
  const double half = speed(make_blend(view_, names, {.weights = std::vector<double>{1, 1}}).clip);
  EXPECT_GT(half, slow + 0.25 * (fast - slow));
  EXPECT_LT(half, slow + 0.75 * (fast - slow));
}

TEST_F(Transitions, blends_name_what_is_wrong) {
  const std::vector<std::string> names{"walk_normal_001", "walk_fast_001"};
  EXPECT_THROW(static_cast<void>(make_blend(view_, names, {.weights = std::vector<double>{1}})), Error);
  EXPECT_THROW(static_cast<void>(make_blend(view_, names, {.weights = std::vector<double>{1, -1}})), Error);
  EXPECT_THROW(static_cast<void>(make_blend(view_, names, {.at = 1.5})), Error);
  EXPECT_THROW(static_cast<void>(make_blend(view_, std::vector<std::string>{})), Error);
}

TEST(Bezier, passes_through_its_motions_without_corners) {
  const Eigen::MatrixXd vectors = (Eigen::MatrixXd(4, 2) << 0, 0, 1, 2, 3, 2, 1.1, 1.0).finished();
  const auto curve = BezierWeights::through_motions(vectors, 3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(curve.at(i), Eigen::VectorXd::Unit(4, i)) << i;
  const Eigen::VectorXd before = curve.at(1) - curve.at(1 - 1e-5), after = curve.at(1 + 1e-5) - curve.at(1);
  EXPECT_LT((before - after).norm(), 1e-3 * before.norm());
  for (double t = 0; t <= 2; t += 0.1) EXPECT_NEAR(curve.at(t).sum(), 1, 1e-12);
}

TEST(Bezier, a_near_neighbour_becomes_a_control_point) {
  const Eigen::MatrixXd vectors = (Eigen::MatrixXd(3, 1) << 0, 3, 1.05).finished();
  const auto near = BezierWeights::through_motions(vectors, 2);
  EXPECT_EQ(near.controls()(1, 2), 1);
  const Eigen::MatrixXd far = (Eigen::MatrixXd(3, 1) << 0, 3, 50).finished();
  EXPECT_TRUE(BezierWeights::through_motions(far, 2).controls().col(2).isZero());
}

}  // namespace
}  // namespace kinespace
