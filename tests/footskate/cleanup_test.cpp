// Cleanup: known skate goes, everything else stays.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"
#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

// What is left of the skate where the feet truly stand.
double slide_left(const Clip& clean, const SampleMotion& truth) {
  const Feet feet = require_feet(clean);
  return foot_slide_cm_s(foot_tracks(clean, feet), contacts_of(truth, feet)).value_or(0);
}

TEST(Cleanup, takes_known_skate_out_and_keeps_poses_and_accelerations) {
  for (const double scale : {0.9, 1.15}) {
    double before = 0;
    double after = 0;
    double pose = 0;
    double ratio = 0;
    int clips = 0;
    for (const SampleMotion& motion : test::unseen_motions()) {
      const Clip skating = test::with_path_scaled(motion.clip, scale);
      const CleanResult result = clean(skating);
      before += slide_left(skating, motion);
      after += slide_left(result.clip, motion);
      pose += result.report.mean_pose_change_cm;
      ratio += result.report.acceleration_ratio;
      ++clips;
      EXPECT_LT(result.report.mean_pose_change_cm, 1.0) << motion.clip.name;
      EXPECT_LT(result.report.acceleration_ratio, 1.5) << motion.clip.name;
      EXPECT_LT(result.report.floor_penetration_cm, 0.01) << motion.clip.name;
    }
    EXPECT_GT(before / clips, 3);
    EXPECT_LT(after, 0.05 * before);
    EXPECT_LT(pose / clips, 0.5);
    EXPECT_LT(ratio / clips, 1.1);
  }
}

TEST(Cleanup, changes_nothing_in_a_clean_clip) {
  for (const double rate : {30.0, 60.0, 120.0}) {
    for (const SampleMotion& motion : test::unseen_motions(rate)) {
      const CleanResult result = clean(motion.clip);
      EXPECT_LE(largest_move_cm(motion.clip, result.clip), 0.1) << motion.clip.name << " at " << rate;
    }
  }
}

TEST(Cleanup, changes_nothing_in_its_own_output) {
  for (const SampleMotion& motion : test::unseen_motions()) {
    const Clip once = clean(test::with_path_scaled(motion.clip, 1.15)).clip;
    EXPECT_LE(largest_move_cm(once, clean(once).clip), 0.1) << motion.clip.name;
  }
}

TEST(Cleanup, keeps_feet_turned_as_they_were_and_everything_above_the_hips) {
  const SampleMotion walk = make_walk({.duration_s = 4});
  const Clip skating = test::with_path_scaled(walk.clip, 0.9);
  const CleanResult result = clean(skating);
  std::vector<JointFrame> a;
  std::vector<JointFrame> b;
  const int foot = skating.skeleton.find("LeftFoot");
  const int head = skating.skeleton.find("Head");
  for (int f = 0; f < skating.frames; ++f) {
    world_frames(skating, f, a);
    world_frames(result.clip, f, b);
    EXPECT_LT(a[foot].rotation.angularDistance(b[foot].rotation), 0.02);
    EXPECT_LT(a[head].rotation.angularDistance(b[head].rotation), 1e-9);
  }
}

TEST(Cleanup, uses_the_contacts_it_is_given) {
  const SampleMotion walk = make_walk({.duration_s = 4});
  const Clip skating = test::with_path_scaled(walk.clip, 1.15);
  const Feet feet = require_feet(skating);
  const CleanResult result = clean(skating, {.contacts = contacts_of(walk, feet), .passes = 1});
  EXPECT_LT(slide_left(result.clip, walk), 1e-3);
  EXPECT_EQ(result.report.plants.size(), walk.contacts.size());
  const FootContacts outside = {{0, 5, skating.frames}};
  EXPECT_THROW((void)clean(skating, {.contacts = outside}), Error);
}

TEST(Cleanup, lifts_feet_that_are_under_the_floor) {
  const Clip low = test::raised(make_walk({.duration_s = 4}).clip, -2);
  const CleanResult result = clean(low, {.floor_cm = 0});
  EXPECT_LT(result.report.floor_penetration_cm, 0.01);
  EXPECT_EQ(result.report.ground.height_cm, 0);
}

TEST(Cleanup, works_on_a_floor_that_is_not_at_zero_and_states_it) {
  const SampleMotion walk = make_walk({.duration_s = 4});
  const Clip skating = test::raised(test::with_path_scaled(walk.clip, 0.9), 123);
  const CleanResult result = clean(skating);
  EXPECT_NEAR(result.report.ground.height_cm, 123, 0.01);
  EXPECT_LT(slide_left(result.clip, walk), 0.05 * slide_left(skating, walk));
}

TEST(Cleanup, works_on_a_slope) {
  const SampleMotion walk = make_walk({.duration_s = 6});
  const Clip skating = test::on_slope(test::with_path_scaled(walk.clip, 0.9), 0.15);
  const CleanResult result = clean(skating);
  EXPECT_EQ(result.report.ground.kind, GroundKind::slope);
  EXPECT_LT(slide_left(result.clip, walk), 0.1 * slide_left(skating, walk));
  EXPECT_LT(result.report.floor_penetration_cm, 0.05);
}

TEST(Cleanup, of_steps_keeps_every_level) {
  // Two stands with a jump up between them: a box of 30 cm.
  const SampleMotion jump = make_jump({.rise_cm = 40});
  Clip clip = jump.clip;
  auto& track = clip.require_translation_track(0).values;
  for (int f = 0; f < clip.frames; ++f) {
    const double x = std::clamp((static_cast<double>(f) / clip.frames - 0.45) / 0.1, 0.0, 1.0);
    track[f].y() += 30 * x * x * (3 - 2 * x);
  }
  const CleanResult result = clean(clip);
  EXPECT_EQ(result.report.ground.kind, GroundKind::uneven);
  const Feet feet = require_feet(clip);
  const FootTracks before = foot_tracks(clip, feet);
  const FootTracks after = foot_tracks(result.clip, feet);
  for (const int f : {0, clip.frames - 1}) EXPECT_NEAR(after.at[1][f].y(), before.at[1][f].y(), 0.5);
}

TEST(Cleanup, of_one_frame_is_that_frame) {
  const Clip one = slice(make_walk().clip, 10, 1);
  const CleanResult result = clean(one);
  EXPECT_LE(largest_move_cm(one, result.clip), 0.1);
  EXPECT_EQ(result.report.foot_slide_after_cm_s, std::nullopt) << "there is no step from a frame to the next";
}

TEST(Cleanup, of_a_clip_in_which_nothing_touches_changes_nothing) {
  Clip flying = make_stand({.duration_s = 1}).clip;
  auto& track = flying.require_translation_track(0).values;
  for (int f = 0; f < flying.frames; ++f) track[f] += Eigen::Vector3d(3 * f, 100 + 4 * f, 0);
  const CleanResult result = clean(flying);
  EXPECT_TRUE(result.report.plants.empty());
  EXPECT_LE(largest_move_cm(flying, result.clip), 1e-6);
  EXPECT_EQ(result.report.foot_slide_before_cm_s, std::nullopt);
  EXPECT_EQ(result.report.foot_slide_after_cm_s, std::nullopt);
  ASSERT_EQ(doubts_about(result.report).size(), 1U);
  EXPECT_THAT(doubts_about(result.report)[0], testing::HasSubstr("not known"));
  EXPECT_EQ(compare_skate(flying, flying)->foot_slide_cm_s, std::nullopt);
}

TEST(Cleanup, says_when_it_made_things_worse) {
  const CleanReport good = clean(test::with_path_scaled(make_walk().clip, 1.15)).report;
  EXPECT_THAT(doubts_about(good), testing::IsEmpty());
  CleanReport sliding = good;
  sliding.foot_slide_after_cm_s = *good.foot_slide_before_cm_s + 1;
  ASSERT_EQ(doubts_about(sliding).size(), 1U);
  EXPECT_THAT(doubts_about(sliding)[0], testing::HasSubstr("slide more than before"));
  CleanReport jerked = good;
  jerked.acceleration_ratio = 1.51;
  ASSERT_EQ(doubts_about(jerked).size(), 1U);
  EXPECT_THAT(doubts_about(jerked)[0], testing::HasSubstr("1.5 times"));
}

TEST(Cleanup, of_a_skeleton_without_feet_says_how_to_name_them) {
  Skeleton chain;
  for (int j = 0; j < 4; ++j)
    chain.joints.push_back({.name = "j" + std::to_string(j), .parent = j - 1, .offset = {0, 9, 0}});
  try {
    (void)clean(make_clip("worm", chain, 30, 4));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--feet LEFT,RIGHT"));
  }
}

TEST(Cleanup, names_an_option_out_of_range) {
  EXPECT_THROW(CleanOptions{.passes = 0}.validate(), Error);
  EXPECT_THROW(CleanOptions{.floor_cm = 1e9}.validate(), Error);
}

TEST(SkateMeasures, of_a_scaled_path_are_what_was_put_in) {
  // A walk along +Z at 130 cm/s: scaled by 0.9 its feet slide backwards at about 13 cm/s.
  const SampleMotion walk = make_walk({.duration_s = 5, .take = {.variation = 0}});
  const auto skate = compare_skate(walk.clip, test::with_path_scaled(walk.clip, 0.9));
  ASSERT_TRUE(skate);
  EXPECT_NEAR(skate->foot_slide_cm_s.value(), 13, 1.5);
  EXPECT_NEAR(skate->floor_penetration_cm, 0, 0.05);
  const auto sunk = compare_skate(walk.clip, test::raised(walk.clip, -4));
  EXPECT_NEAR(sunk->floor_penetration_cm, 4, 0.05);
  EXPECT_NEAR(sunk->foot_slide_cm_s.value(), 0, 0.2);
}

// Feet on rails: the left ankle at a height and a speed, the others out of the way.
FootTracks on_rails(double height_cm, double speed_cm_s) {
  FootTracks out{.frames = 31, .rate_hz = 30};
  for (int f = 0; f < out.frames; ++f) {
    out.at[0].emplace_back(0, 8 + height_cm, f / out.rate_hz * speed_cm_s);
    out.at[2].emplace_back(20, 60, 0);
    out.root.emplace_back(0, 90, 0);
  }
  return out;
}

const FootLevel flat_floor{.ground = {}, .standing_cm = {8, 0, 8, 0}};

TEST(SkateMeasures, count_feet_that_are_low_and_slow_by_geometry_alone) {
  EXPECT_NEAR(foot_motion(on_rails(0, 10), flat_floor).slide_cm_s.value(), 10, 1e-9);
  EXPECT_EQ(foot_motion(on_rails(0, 30), flat_floor).slide_cm_s, std::nullopt) << "a step, not a slide";
  EXPECT_EQ(foot_motion(on_rails(6, 10), flat_floor).slide_cm_s, std::nullopt) << "in the air";
  EXPECT_NEAR(foot_motion(on_rails(6, 10), flat_floor).lowest_speed_cm_s.value(), 10, 1e-9);
  EXPECT_NEAR(foot_motion(on_rails(6, 10), flat_floor).hover_cm, 6, 1e-9);
  EXPECT_NEAR(foot_motion(on_rails(-9, 10), flat_floor).penetration_cm, 1, 1e-9);
  EXPECT_EQ(foot_motion(on_rails(0, 10), flat_floor, 5, 5).lowest_speed_cm_s, std::nullopt) << "one frame has no speed";
}

TEST(SkateMeasures, by_geometry_see_what_a_scaled_path_does) {
  const SampleMotion walk = make_walk({.duration_s = 5, .take = {.variation = 0}});
  const auto skate = compare_skate(walk.clip, test::with_path_scaled(walk.clip, 0.9));
  ASSERT_TRUE(skate);
  EXPECT_LT(skate->of_a.slide_cm_s.value(), 6);
  EXPECT_GT(skate->of_b.slide_cm_s.value(), 10);
  EXPECT_GT(skate->of_b.lowest_speed_cm_s.value(), skate->of_a.lowest_speed_cm_s.value() + 5);
}

TEST(SkateMeasures, pose_change_does_not_count_travel_and_turn) {
  const Clip walk = make_walk().clip;
  EXPECT_NEAR(mean_pose_change_cm(walk, test::with_path_scaled(walk, 1.3)), 0, 1e-9);
  EXPECT_NEAR(mean_pose_change_cm(walk, test::on_slope(walk, 0.3)), 0, 1e-9);
}

}  // namespace
}  // namespace kinespace
