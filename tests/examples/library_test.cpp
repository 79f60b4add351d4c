// The collection of sample motions, its skeleton, its options and its files.
#include <fstream>
#include <functional>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_files.h"
#include "kinespace/base/error.h"
#include "kinespace/motion/read.h"
#include "tests/examples/sample_support.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::library;
using testing::HasSubstr;

TEST(SampleSkeleton, has_22_joints_and_the_asked_height) {
  for (const double height : {100.0, 175.0, 220.0}) {
    const Skeleton skeleton = sample_skeleton(height);
    EXPECT_EQ(skeleton.joint_count(), 22);
    EXPECT_NEAR(skeleton.rest_height(), height, 1e-9);
    EXPECT_EQ(skeleton.rotating_joints().size(), 22U);
  }
}

TEST(SampleSkeleton, stands_on_the_floor_facing_z_with_its_left_at_x) {
  const Clip rest = make_clip("rest", sample_skeleton(175), 60, 1);
  const JointPositions p = joint_positions(rest);
  for (const std::string side : {"Left", "Right"}) {
    EXPECT_NEAR(p.at(0, rest.skeleton.find(side + "ToeBase")).y(), 0, 1e-9);
    EXPECT_GT(p.at(0, rest.skeleton.find(side + "ToeBase")).z(), 5);
    const double outwards = p.at(0, rest.skeleton.find(side + "Hand")).x();
    EXPECT_GT(side == "Left" ? outwards : -outwards, 60);
  }
}

TEST(SampleSkeleton, every_leaf_has_an_end_site_with_a_length) {
  const Skeleton skeleton = sample_skeleton();
  std::set<int> parents;
  for (const Joint& joint : skeleton.joints) parents.insert(joint.parent);
  int leaves = 0;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const auto& end = skeleton.joints[j].end_site;
    EXPECT_EQ(end.has_value(), !parents.contains(j)) << skeleton.joints[j].name;
    EXPECT_GT(end.value_or(Eigen::Vector3d(6, 0, 0)).norm(), 5) << skeleton.joints[j].name;
    leaves += end.has_value();
  }
  EXPECT_EQ(leaves, 5);
}

TEST(SampleLibrary, holds_every_content_with_equal_skeletons_and_unique_names) {
  EXPECT_EQ(library().size(), 72U);
  std::set<std::string> names;
  std::set<std::string> contents;
  for (const SampleMotion& motion : library()) {
    names.insert(motion.clip.name);
    contents.insert(motion.labels.at(0));
    ASSERT_EQ(motion.labels.size(), 2U);
    EXPECT_TRUE(motion.clip.name.starts_with(motion.labels[0] + "_" + motion.labels[1] + "_")) << motion.clip.name;
    EXPECT_TRUE(motion.clip.skeleton.same_tree(library().front().clip.skeleton));
    EXPECT_EQ(motion.clip.rate_hz, 60);
    EXPECT_GE(motion.clip.duration_s(), 1);
  }
  EXPECT_EQ(names.size(), library().size());
  EXPECT_THAT(contents, testing::ElementsAre("jump", "raise", "run", "stand", "turn", "walk", "wave"));
}

TEST(SampleLibrary, is_the_same_for_a_seed_and_another_for_another) {
  const auto again = sample_library({.seed = 1});
  const auto other = sample_library({.seed = 2});
  ASSERT_EQ(again.size(), library().size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].clip.rotations, library()[i].clip.rotations);
    EXPECT_EQ(again[i].contacts, library()[i].contacts);
    EXPECT_NE(other[i].clip.rotations, library()[i].clip.rotations) << library()[i].clip.name;
  }
}

TEST(SampleLibrary, takes_of_a_motion_differ) {
  for (std::size_t i = 1; i < library().size(); ++i) {
    EXPECT_NE(library()[i].clip.rotations, library()[i - 1].clip.rotations) << library()[i].clip.name;
  }
}

TEST(SampleOptions, without_variation_the_seed_changes_nothing) {
  const auto walk = [](std::uint64_t seed, double variation) {
    return make_walk({.take = {.seed = seed, .variation = variation}}).clip.rotations;
  };
  EXPECT_EQ(walk(1, 0), walk(2, 0));
  EXPECT_NE(walk(1, 1), walk(2, 1));
}

TEST(SampleOptions, out_of_range_is_refused_by_name_value_and_range) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::function<void()>, std::string>> cases = {
      {[] { (void)make_walk({.speed_m_s = 9}); }, "speed_m_s = 9"},
      {[=] { (void)make_walk({.speed_m_s = nan}); }, "speed_m_s = nan"},
      {[] { (void)make_walk({.speed_m_s = 2, .cadence_per_min = 60}); }, "steps of 2.00 m"},
      {[] { (void)make_walk({.start_phase = 1.5}); }, "start_phase = 1.5"},
      {[] { (void)make_walk({.style = "a/b"}); }, "style = \"a/b\""},
      {[] { (void)make_walk({.take = {.rate_hz = 0}}); }, "rate_hz = 0"},
      {[] { (void)make_run({.speed_m_s = 1}); }, "speed_m_s = 1"},
      {[] { (void)make_run({.duration_s = 1e9}); }, "duration_s = 1000000000"},
      {[] { (void)make_run({.speed_m_s = 4.5, .take = {.height_cm = 100}}); }, "steps of"},
      {[] { (void)make_turn({.side = Side::both}); }, "side = both"},
      {[] { (void)make_turn({.angle_deg = 0}); }, "angle_deg = 0"},
      {[] { (void)make_wave({.waves = 0}); }, "waves = 0"},
      {[] { (void)make_raise({.angle_deg = 200}); }, "angle_deg = 200"},
      {[] { (void)make_jump({.rise_cm = 100}); }, "rise_cm = 100"},
      {[] { (void)make_stand({.sway = -1}); }, "sway = -1"},
      {[] { (void)sample_skeleton(3); }, "height_cm = 3"},
      {[] { (void)sample_library({.takes = 0}); }, "takes = 0"},
  };
  for (const auto& [call, expected] : cases) {
    try {
      call();
      ADD_FAILURE() << "accepted: " << expected;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_THAT(error.what(), HasSubstr(expected));
    }
  }
}

TEST(SampleFiles, clips_come_back_from_bvh_as_they_were) {
  const test::TemporaryFolder folder;
  for (const SampleMotion& motion : library()) {
    write_sample(folder.path(), motion);
    const Clip back = read_clip(folder.path() / (motion.clip.name + ".bvh"));
    ASSERT_TRUE(back.skeleton.same_tree(motion.clip.skeleton));
    EXPECT_EQ(back.name, motion.clip.name);
    EXPECT_EQ(back.frames, motion.clip.frames);
    EXPECT_NEAR(back.rate_hz, motion.clip.rate_hz, 1e-9);
    const JointPositions a = joint_positions(motion.clip);
    const JointPositions b = joint_positions(back);
    double worst = 0;
    for (std::size_t i = 0; i < a.values.size(); ++i) worst = std::max(worst, (a.values[i] - b.values[i]).norm());
    EXPECT_LT(worst, 1e-4) << motion.clip.name;
  }
}

TEST(SampleFiles, the_description_says_what_the_motion_is) {
  const test::TemporaryFolder folder;
  const SampleMotion motion = make_jump();
  write_sample(folder.path(), motion);
  const auto json = nlohmann::json::parse(std::ifstream(folder.path() / (motion.clip.name + ".json")));
  EXPECT_EQ(json.at("clip"), motion.clip.name);
  EXPECT_EQ(json.at("frames"), motion.clip.frames);
  EXPECT_EQ(json.at("rate_hz"), 60);
  EXPECT_EQ(json.at("labels"), (nlohmann::json{"jump", "up"}));
  ASSERT_EQ(json.at("contacts").size(), motion.contacts.size());
  EXPECT_EQ(json.at("contacts")[0].at("side"), "left");
  EXPECT_EQ(json.at("contacts")[0].at("joint"), "LeftFoot");
  EXPECT_EQ(json.at("contacts")[0].at("last_frame"), motion.contacts[0].last_frame);
}

}  // namespace
}  // namespace kinespace
