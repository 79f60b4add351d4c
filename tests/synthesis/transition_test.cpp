#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/footskate/skate_measures.h"
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

TEST_F(Transitions, the_first_motion_is_played_as_it_is_until_shortly_before_the_overlap) {
  const auto plan = plan_transition(view_, walk_to_run);
  ASSERT_TRUE(plan);
  const Clip first = view_.clip(view_.require_clip(walk_to_run[0]));
  // The legs and the root may come to what they have to do from 0.4 s before it on.
  const int frames = static_cast<int>((plan->transition.begin[0] - 0.4) * first.rate_hz);
  EXPECT_LT(compare(slice(first, 0, frames), slice(plan->transition.clip, 0, frames)).max_joint_error_cm, 1e-6);
}

TEST_F(Transitions, the_second_motion_follows_as_it_is_shortly_after_the_overlap_but_for_where_it_stands) {
  const std::vector<std::string> run_to_walk{"run_normal_001", "walk_normal_001"};
  const auto plan = plan_transition(view_, run_to_walk);
  ASSERT_TRUE(plan);
  const Clip& made = plan->transition.clip;
  const Clip second = view_.clip(view_.require_clip(run_to_walk[1]));
  const Join& join = plan->transition.joins[0];
  // A foot that was held away from its place comes home within a second.
  const int first_frame = static_cast<int>(std::ceil((join.connection.entered_s + 1.0) * second.rate_hz + 1e-6));
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

// Measured on what comes out, by geometry alone.
FootMotion feet_in_overlap(const Transition& made, const Clip& first) {
  const Feet feet = require_feet(first);
  const FootLevel level = foot_level(foot_tracks(first, feet));
  const double rate = made.clip.rate_hz;
  return foot_motion(foot_tracks(made.clip, feet), level, static_cast<int>(std::ceil(made.begin[0] * rate)),
                     static_cast<int>((made.begin[0] + made.joins[0].duration_s) * rate));
}

TEST_F(Transitions, feet_slide_no_more_than_in_the_clips_and_less_than_without_a_plan) {
  const auto rows = view_.library().clips();
  double slide = 0, usual = 0, unplanned = 0;
  for (std::size_t i = 0; i < rows.size(); i += 2) {
    const std::vector<std::string> names{rows[i].name, rows[(i * 5 + 3) % rows.size()].name};
    const auto plan = plan_transition(view_, names);
    TransitionPlanOptions as_blended;
    as_blended.join.plan_feet = false;
    const auto plain = plan_transition(view_, names, as_blended);
    ASSERT_TRUE(plan && plain);
    const Join& join = plan->transition.joins[0];
    EXPECT_TRUE(join.feet_planned) << names[0] << " to " << names[1];
    EXPECT_FALSE(plain->transition.joins[0].feet_planned);
    const Clip first = view_.clip(view_.require_clip(names[0]));
    const FootMotion feet = feet_in_overlap(plan->transition, first);
    EXPECT_NEAR(feet.slide_cm_s.value_or(0), join.feet->slide_cm_s.value_or(0), 0.5)
        << "what it says is what comes out";
    slide += feet.slide_cm_s.value_or(0);
    usual += join.feet_of_sources->slide_cm_s.value_or(0);
    unplanned += feet_in_overlap(plain->transition, first).slide_cm_s.value_or(0);
  }
  EXPECT_LT(slide, 1.3 * usual);
  EXPECT_LT(slide, 0.5 * unplanned);
}

TEST_F(Transitions, between_two_that_stand_no_foot_slides) {
  for (const char* second : {"wave_left_001", "wave_right_001"}) {
    const auto plan = plan_transition(view_, std::vector<std::string>{"stand_calm_001", second});
    ASSERT_TRUE(plan);
    const Clip first = view_.clip(view_.require_clip("stand_calm_001"));
    EXPECT_LT(feet_in_overlap(plan->transition, first).slide_cm_s.value_or(0), 1.5) << second;
  }
}

TEST_F(Transitions, keep_near_the_speed_of_the_motions) {
  const auto rows = view_.library().clips();
  for (std::size_t i = 0; i < rows.size(); i += 3) {
    const auto plan = plan_transition(view_, std::vector{rows[i].name, rows[(i * 7 + 2) % rows.size()].name});
    ASSERT_TRUE(plan);
    const double speed = plan->transition.joins[0].connection.speed();
    EXPECT_GE(speed, 0.8 - 1e-6);
    EXPECT_LE(speed, 1.25 + 1e-6);
  }
  TransitionPlanOptions wrong;
  wrong.join.largest_speed = 0.9;
  EXPECT_THROW(static_cast<void>(plan_transition(view_, walk_to_run, wrong)), Error);
}

TEST_F(Transitions, inertialization_leaves_no_step_at_the_seam) {
  TransitionPlanOptions options;
  options.join.way = JoinWay::inertialization;
  options.join.plan_feet = false;
  const auto plan = plan_transition(view_, walk_to_run, options);
  ASSERT_TRUE(plan);
  const Join& join = plan->transition.joins[0];
  EXPECT_EQ(join.way, JoinWay::inertialization);
  EXPECT_NEAR(join.connection.speed(), 1, 1e-9);
  EXPECT_LE(join.ratios.speed, 1.2);
  EXPECT_LE(join.ratios.acceleration, 2);
  // After its end the second motion is what it was.
  const Clip second = view_.clip(view_.require_clip(walk_to_run[1]));
  const int count = second.frames - static_cast<int>(std::ceil(join.connection.entered_s * second.rate_hz + 1e-6));
  ASSERT_GT(count, 5);
  const Clip& made = plan->transition.clip;
  for (int f = 0; f < count; ++f) {
    for (int j = made.skeleton.travel_root() + 1; j < made.skeleton.joint_count(); ++j) {
      EXPECT_LT(
          made.rotation(j, made.frames - count + f).angularDistance(second.rotation(j, second.frames - count + f)),
          1e-6);
    }
  }
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
