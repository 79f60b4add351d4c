// The floor from where feet rest.
#include <gtest/gtest.h>

#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

Ground ground_of(const Clip& clip) {
  return estimate_ground(foot_tracks(clip, require_feet(clip)));
}

TEST(GroundEstimate, is_the_floor_of_every_sample_motion) {
  for (const SampleMotion& motion : test::unseen_motions()) {
    const Ground ground = ground_of(motion.clip);
    EXPECT_EQ(ground.kind, GroundKind::flat) << motion.clip.name;
    EXPECT_NEAR(ground.height_cm, 0, 1e-6) << motion.clip.name;
  }
}

TEST(GroundEstimate, follows_a_floor_that_is_not_at_zero) {
  for (const double height : {-87.5, 12.0, 400.0}) {
    EXPECT_NEAR(ground_of(test::raised(make_walk().clip, height)).height_cm, height, 1e-6);
  }
}

TEST(GroundEstimate, does_not_mind_feet_that_skate) {
  for (const double scale : {0.9, 1.15}) {
    const Ground ground = ground_of(test::with_path_scaled(make_run({.duration_s = 3}).clip, scale));
    EXPECT_EQ(ground.kind, GroundKind::flat);
    EXPECT_NEAR(ground.height_cm, 0, 0.05);
  }
}

// A plane goes through any three places: feet that rest at two heights, as of one who kneels, are no slope.
TEST(GroundEstimate, believes_no_slope_from_a_few_places) {
  Clip clip = make_walk({.duration_s = 0.5}).clip;
  EXPECT_NE(ground_of(test::on_slope(clip, 0.4)).kind, GroundKind::slope) << "two steps";
  EXPECT_EQ(ground_of(test::on_slope(make_walk({.duration_s = 6}).clip, 0.4)).kind, GroundKind::slope);
}

TEST(GroundEstimate, tells_a_slope) {
  const Ground ground = ground_of(test::on_slope(make_walk({.duration_s = 6}).clip, 0.2));
  ASSERT_EQ(ground.kind, GroundKind::slope);
  EXPECT_NEAR(ground.gradient.y(), 0.2, 0.01);
  EXPECT_NEAR(ground.gradient.x(), 0, 0.02);
  EXPECT_NEAR(ground.at({0, 0, 100}), 20, 1);
}

TEST(GroundEstimate, calls_two_levels_uneven) {
  // The same stand twice, the second time on a box.
  const SampleMotion low = make_stand({.duration_s = 2});
  Clip clip = low.clip;
  auto& track = clip.require_translation_track(0).values;
  for (int f = clip.frames / 2; f < clip.frames; ++f) track[f].y() += 40;
  const Ground ground = ground_of(clip);
  EXPECT_EQ(ground.kind, GroundKind::uneven);
  EXPECT_NEAR(ground.height_cm, 0, 0.1);
}

TEST(GroundEstimate, of_one_frame_is_the_lowest_point) {
  const Clip clip = test::raised(slice(make_stand().clip, 0, 1), 7);
  EXPECT_NEAR(ground_of(clip).height_cm, 7, 0.1);
}

TEST(Rests, of_a_foot_held_in_the_air_do_not_bear_the_body) {
  // One leg lifted for the whole clip: the hip bent by 60 degrees.
  Clip clip = make_stand({.duration_s = 2}).clip;
  const int hip = clip.skeleton.find("LeftUpLeg");
  const Eigen::Quaterniond lift(Eigen::AngleAxisd(-1.05, Eigen::Vector3d::UnitX()));
  for (int f = 0; f < clip.frames; ++f) clip.set_rotation(hip, f, clip.rotation(hip, f) * lift);
  const FootTracks tracks = foot_tracks(clip, require_feet(clip));
  Ground uneven = estimate_ground(tracks);
  for (const GroundKind kind : {GroundKind::flat, GroundKind::uneven}) {
    uneven.kind = kind;
    uneven.height_cm = 0;
    for (const Rest& rest : bearing_rests(tracks, uneven)) EXPECT_GE(rest.slot, 2);
    EXPECT_FALSE(bearing_rests(tracks, uneven).empty());
  }
}

}  // namespace
}  // namespace kinespace
