#include "kinespace/motion/plausibility.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/motion/read.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<DoubtKind> kinds(const Clip& clip) {
  std::vector<DoubtKind> out;
  for (const Doubt& doubt : doubts_about(clip)) out.push_back(doubt.kind);
  return out;
}

// A body of 170 cm that walks along Z, its feet on the floor.
Clip person(double scale = 1, int frames = 300) {
  Skeleton skeleton;
  const auto add = [&](const char* name, int parent, double x, double y) {
    skeleton.joints.push_back({.name = name, .parent = parent, .offset = scale * Eigen::Vector3d(x, y, 0)});
    return skeleton.joint_count() - 1;
  };
  const int hips = add("Hips", -1, 0, 90);
  for (const double side : {-1.0, 1.0}) {
    const int knee = add(side < 0 ? "RightKnee" : "LeftKnee", hips, side * 10, -43);
    add(side < 0 ? "RightFoot" : "LeftFoot", knee, 0, -43);
  }
  const int chest = add("Chest", hips, 0, 50);
  add("Head", chest, 0, 30);
  add("LeftHand", chest, 75, 5);
  add("RightHand", chest, -75, 5);
  skeleton.joints.front().channels = {Channel::x_position, Channel::y_position, Channel::z_position,
                                      Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  Clip clip = make_clip("person", std::move(skeleton), 100, frames);
  auto& root = clip.require_translation_track(0).values;
  for (int f = 0; f < frames; ++f) root[static_cast<std::size_t>(f)] = scale * Eigen::Vector3d(0, 90, 1.3 * f);
  return clip;
}

// The whole world of a clip turned about X.
Clip turned(Clip clip, double radians) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitX()));
  for (Eigen::Vector3d& p : clip.require_translation_track(0).values) p = turn * p;
  for (int f = 0; f < clip.frames; ++f) clip.set_rotation(0, f, turn * clip.rotation(0, f));
  return clip;
}

Clip raised(Clip clip, double cm) {
  for (Eigen::Vector3d& p : clip.require_translation_track(0).values) p.y() += cm;
  return clip;
}

TEST(Plausibility, there_is_no_doubt_about_a_person_on_the_floor) {
  EXPECT_THAT(doubts_about(person()), IsEmpty());
  EXPECT_THAT(doubts_about(person(1, 1)), IsEmpty());
  EXPECT_THAT(doubts_about(raised(person(), 15)), IsEmpty()) << "a step up";
}

TEST(Plausibility, a_person_in_another_unit_is_told) {
  for (const double scale : {0.01, 0.1, 1 / 2.54, 1 / 30.48, 10.0}) {
    ASSERT_THAT(kinds(person(scale)), ElementsAre(DoubtKind::height)) << scale;
  }
  EXPECT_THAT(doubts_about(person(0.01)).front().text, HasSubstr("are they in m?"));
  EXPECT_THAT(doubts_about(person(10)).front().text, HasSubstr("are they in mm?"));
  EXPECT_THAT(doubts_about(person(1 / 2.54)).front().text, HasSubstr("are they in inch?"));
}

TEST(Plausibility, another_axis_up_is_told_whatever_the_pose_and_once) {
  EXPECT_THAT(kinds(turned(person(), std::numbers::pi / 2)), ElementsAre(DoubtKind::axis));
  EXPECT_THAT(kinds(turned(person(), -std::numbers::pi / 2)), ElementsAre(DoubtKind::axis));
  EXPECT_THAT(kinds(turned(person(0.01), std::numbers::pi / 2)), ElementsAre(DoubtKind::height, DoubtKind::axis));
  EXPECT_THAT(doubts_about(turned(person(), std::numbers::pi / 2)).front().text, HasSubstr("is Z up in the file?"));
  EXPECT_THAT(kinds(turned(person(1, 1), 0.5)), IsEmpty()) << "leaning";
}

TEST(Plausibility, a_floor_far_from_0_is_told) {
  EXPECT_THAT(kinds(raised(person(), 100)), ElementsAre(DoubtKind::floor));
  EXPECT_THAT(kinds(raised(person(), -100)), ElementsAre(DoubtKind::floor));
}

TEST(Plausibility, a_jump_is_no_doubt_about_the_floor) {
  Clip clip = person();
  auto& root = clip.require_translation_track(0).values;
  for (int f = 100; f < 200; ++f) root[static_cast<std::size_t>(f)].y() += 120;
  EXPECT_THAT(doubts_about(clip), IsEmpty());
}

TEST(Plausibility, what_has_few_joints_is_no_body) {
  Skeleton chain;
  for (int j = 0; j < 4; ++j) {
    chain.joints.push_back({.name = "j" + std::to_string(j), .parent = j - 1, .offset = {9, 0, 0}});
  }
  EXPECT_THAT(doubts_about(make_clip("snake", chain, 30, 10)), IsEmpty());
}

TEST(Plausibility, of_real_clips_there_is_none) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  int clips = 0;
  for (const char* folder : {"bandai1", "bandai2", "cmu/01", "cmu/02"}) {
    if (!std::filesystem::is_directory(data / folder)) continue;
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(data / folder)) {
      if (!is_motion_file(entry.path()) || ++files % 23 != 1) continue;
      for (const Doubt& doubt : doubts_about(read_clip(entry.path()))) ADD_FAILURE() << entry.path() << doubt.text;
      ++clips;
    }
  }
  EXPECT_GT(clips, 5);
}

}  // namespace
}  // namespace kinespace
