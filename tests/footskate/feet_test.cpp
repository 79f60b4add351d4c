// Feet by name, by shape and as named by the user.
#include "kinespace/footskate/feet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

std::string name_of(const Clip& clip, int joint) {
  return joint < 0 ? "-" : clip.skeleton.joints[joint].name;
}

std::string legs_of(const Clip& clip, const Feet& feet) {
  std::string out;
  for (const Leg& leg : feet.legs) {
    for (const int joint : {leg.hip, leg.knee, leg.ankle, leg.toe}) out += name_of(clip, joint) + " ";
  }
  return out;
}

const std::string usual = "LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg RightFoot RightToeBase ";

void rename(Clip& clip, const std::string& from, const std::string& to) {
  clip.skeleton.joints[clip.skeleton.find(from)].name = to;
}

TEST(Feet, are_found_by_usual_names) {
  const Clip clip = make_walk().clip;
  const Feet feet = require_feet(clip);
  EXPECT_EQ(legs_of(clip, feet), usual);
  EXPECT_NEAR(feet.leg_length_cm, 0.491 * 175, 1e-9);
}

TEST(Feet, are_found_by_the_names_of_other_systems) {
  for (const auto& [left, right] :
       std::vector<std::pair<std::string, std::string>>{{"mixamorig:LeftFoot", "mixamorig:RightFoot"},
                                                        {"lfoot", "rfoot"},
                                                        {"Foot_L", "Foot_R"},
                                                        {"l_ankle", "r_ankle"}}) {
    Clip clip = make_stand().clip;
    rename(clip, "LeftFoot", left);
    rename(clip, "RightFoot", right);
    const Feet feet = require_feet(clip);
    EXPECT_EQ(name_of(clip, feet.legs[0].ankle), left);
    EXPECT_EQ(name_of(clip, feet.legs[1].ankle), right);
  }
}

TEST(Feet, are_found_by_shape_when_names_say_nothing) {
  for (const SampleMotion& motion : {make_walk(), make_raise(), make_jump()}) {
    Clip clip = motion.clip;
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) clip.skeleton.joints[j].name = "joint " + std::to_string(j);
    const Feet feet = require_feet(clip);
    for (int j = 0; j < clip.skeleton.joint_count(); ++j)
      clip.skeleton.joints[j].name = motion.clip.skeleton.joints[j].name;
    EXPECT_EQ(legs_of(clip, feet), usual) << clip.name;
  }
}

TEST(Feet, hips_are_where_the_thigh_starts_whatever_joints_are_between) {
  // A joint in the middle of the thigh, as twist joints are, and one between pelvis and hip, off the line.
  Clip clip = make_walk().clip;
  const int hip = clip.skeleton.find("LeftUpLeg");
  const int knee = clip.skeleton.find("LeftLeg");
  Skeleton& s = clip.skeleton;
  const Eigen::Vector3d half = s.joints[knee].offset / 2;
  s.joints[knee].offset = half;
  s.joints.insert(s.joints.begin() + knee, Joint{.name = "Twist", .parent = hip, .offset = half});
  for (Joint& joint : s.joints) {
    if (joint.parent >= knee && joint.name != "Twist") ++joint.parent;
  }
  s.joints[knee + 1].parent = knee;
  const Clip longer = make_clip("twist", s, 30, 5);
  const Feet feet = require_feet(longer);
  EXPECT_EQ(name_of(longer, feet.legs[0].hip), "LeftUpLeg");
  EXPECT_EQ(name_of(longer, feet.legs[0].knee), "LeftLeg");
}

TEST(Feet, can_be_named) {
  Clip clip = make_walk().clip;
  rename(clip, "LeftFoot", "a");
  rename(clip, "RightFoot", "b");
  const Feet feet = require_feet(clip, FeetNames::parse("b,a"));  // as the user says, even if it is the wrong way round
  EXPECT_EQ(name_of(clip, feet.legs[0].ankle), "b");
  EXPECT_EQ(name_of(clip, feet.legs[0].knee), "RightLeg");
}

TEST(Feet, that_are_not_there_give_an_error_that_says_how_to_name_them) {
  Skeleton snake;
  for (int j = 0; j < 8; ++j) {
    snake.joints.push_back({.name = "bone" + std::to_string(j), .parent = j - 1, .offset = {0, 0, 20}});
  }
  const Clip clip = make_clip("snake", snake, 30, 10);
  EXPECT_FALSE(find_feet(clip));
  try {
    (void)require_feet(clip);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), testing::HasSubstr("--feet LEFT,RIGHT"));
    EXPECT_THAT(error.what(), testing::HasSubstr("snake"));
  }
}

TEST(Feet, names_that_do_not_fit_are_refused) {
  const Clip clip = make_walk().clip;
  EXPECT_THROW((void)require_feet(clip, {"LeftFoot", "NoSuchJoint"}), Error);
  EXPECT_THROW((void)require_feet(clip, {"LeftFoot", "Spine"}), Error);
  for (const char* text : {"", "LeftFoot", "LeftFoot,", ",RightFoot", "x,x"}) {
    EXPECT_THROW((void)FeetNames::parse(text), Error) << text;
  }
}

}  // namespace
}  // namespace kinespace
