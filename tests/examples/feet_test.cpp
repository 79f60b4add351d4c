// Feet of the sample motions: planted exactly, never below the floor, legs never stretched.
#include <gtest/gtest.h>

#include "tests/examples/sample_support.h"

namespace kinespace {
namespace {

using test::all_motions;
using test::joint;
using test::library;

TEST(SampleFeet, planted_joints_stand_still_to_rounding) {
  for (const SampleMotion& motion : all_motions()) {
    const JointPositions positions = joint_positions(motion.clip);
    double slip = 0;
    for (const Contact& contact : motion.contacts) {
      for (int f = contact.first_frame; f <= contact.last_frame; ++f) {
        const auto moved = positions.at(f, contact.joint) - positions.at(contact.first_frame, contact.joint);
        slip = std::max(slip, moved.norm());
      }
    }
    EXPECT_LT(slip, 1e-9) << motion.clip.name;
  }
}

TEST(SampleFeet, planted_joints_stand_on_the_floor) {
  for (const SampleMotion& motion : all_motions()) {
    const JointPositions positions = joint_positions(motion.clip);
    const double ankle = 0.039 * motion.clip.skeleton.rest_height();
    for (const Contact& contact : motion.contacts) {
      const bool is_toe = motion.clip.skeleton.joints[contact.joint].name.ends_with("ToeBase");
      EXPECT_NEAR(positions.at(contact.first_frame, contact.joint).y(), is_toe ? 0 : ankle, 1e-9) << motion.clip.name;
    }
  }
}

TEST(SampleFeet, contacts_name_a_foot_and_lie_within_the_clip) {
  for (const SampleMotion& motion : all_motions()) {
    for (const Contact& contact : motion.contacts) {
      const std::string& name = motion.clip.skeleton.joints[contact.joint].name;
      const std::string side = contact.side == Side::left ? "Left" : "Right";
      EXPECT_TRUE(name == side + "Foot" || name == side + "ToeBase") << name;
      EXPECT_GE(contact.first_frame, 0);
      EXPECT_LE(contact.first_frame, contact.last_frame);
      EXPECT_LT(contact.last_frame, motion.clip.frames);
    }
    EXPECT_TRUE(std::ranges::is_sorted(motion.contacts, {}, [](const Contact& c) {
      return std::pair(c.joint, c.first_frame);
    })) << motion.clip.name;
  }
}

// The truth is whole: two frames outside a contact the joint has left its place.
TEST(SampleFeet, contacts_are_as_long_as_the_joint_stands) {
  for (const SampleMotion& motion : all_motions()) {
    const JointPositions positions = joint_positions(motion.clip);
    for (const Contact& contact : motion.contacts) {
      for (const int outside : {contact.first_frame - 2, contact.last_frame + 2}) {
        if (outside < 0 || outside >= motion.clip.frames) continue;
        const auto moved = positions.at(outside, contact.joint) - positions.at(contact.first_frame, contact.joint);
        EXPECT_GT(moved.norm(), 1e-6) << motion.clip.name << " frame " << outside;
      }
    }
  }
}

TEST(SampleFeet, no_point_of_a_foot_is_below_the_floor) {
  std::vector<JointFrame> frames;
  for (const SampleMotion& motion : all_motions()) {
    const Clip& clip = motion.clip;
    const double h = clip.skeleton.rest_height();
    double lowest = 1;
    for (int f = 0; f < clip.frames; ++f) {
      world_frames(clip, f, frames);
      for (const std::string side : {"Left", "Right"}) {
        const JointFrame& foot = frames[joint(clip, side + "Foot")];
        const int toe_joint = joint(clip, side + "ToeBase");
        const JointFrame& toe = frames[toe_joint];
        const Eigen::Vector3d heel = foot.position + foot.rotation * Eigen::Vector3d(0, -0.039 * h, -0.037 * h);
        const Eigen::Vector3d tip = toe.position + toe.rotation * *clip.skeleton.joints[toe_joint].end_site;
        lowest = std::min({lowest, foot.position.y(), toe.position.y(), heel.y(), tip.y()});
      }
    }
    EXPECT_GT(lowest, -1e-6) << clip.name;
  }
}

TEST(SampleFeet, legs_are_never_stretched_to_their_length) {
  for (const SampleMotion& motion : all_motions()) {
    const JointPositions positions = joint_positions(motion.clip);
    const double leg = (0.245 + 0.246) * motion.clip.skeleton.rest_height();
    for (const std::string side : {"Left", "Right"}) {
      double reach = 0;
      for (int f = 0; f < motion.clip.frames; ++f) {
        const auto hip = positions.at(f, joint(motion.clip, side + "UpLeg"));
        reach = std::max(reach, (positions.at(f, joint(motion.clip, side + "Foot")) - hip).norm() / leg);
      }
      EXPECT_LT(reach, 0.995) << motion.clip.name;
    }
  }
}

// How many feet have a contact at each frame.
std::vector<int> feet_down(const SampleMotion& motion) {
  std::vector<int> out(motion.clip.frames, 0);
  for (int f = 0; f < motion.clip.frames; ++f) {
    for (const Side side : {Side::left, Side::right}) {
      out[f] += std::ranges::any_of(
          motion.contacts, [&](const Contact& c) { return c.side == side && c.first_frame <= f && f <= c.last_frame; });
    }
  }
  return out;
}

TEST(SampleFeet, walkers_always_have_a_foot_on_the_floor) {
  for (const SampleMotion& motion : library()) {
    if (motion.labels.front() != "walk") continue;
    const auto down = feet_down(motion);
    // Where one foot leaves while the other settles, one frame may lie between the two times.
    int without = 0;
    for (const int feet : down) {
      without = feet == 0 ? without + 1 : 0;
      EXPECT_LE(without, 1) << motion.clip.name;
    }
  }
}

TEST(SampleFeet, runners_fly_in_every_step_and_never_have_both_feet_down) {
  for (const SampleMotion& motion : library()) {
    if (motion.labels.front() != "run") continue;
    const auto down = feet_down(motion);
    EXPECT_EQ(std::ranges::max(down), 1) << motion.clip.name;
    const auto flights = std::ranges::count(down, 0);
    EXPECT_GT(flights, motion.clip.frames / 5) << motion.clip.name;
  }
}

TEST(SampleFeet, jumpers_take_off_and_land_with_both_feet) {
  for (const SampleMotion& motion : library()) {
    if (motion.labels.front() != "jump") continue;
    const auto down = feet_down(motion);
    EXPECT_EQ(down.front(), 2);
    EXPECT_EQ(down.back(), 2);
    EXPECT_EQ(std::ranges::count(down, 1), 0) << motion.clip.name;
    EXPECT_GT(std::ranges::count(down, 0), 10) << motion.clip.name;
  }
}

TEST(SampleFeet, those_who_stand_wave_or_raise_do_not_step) {
  for (const SampleMotion& motion : library()) {
    const std::string& content = motion.labels.front();
    if (content != "stand" && content != "wave" && content != "raise") continue;
    ASSERT_EQ(motion.contacts.size(), 4U) << motion.clip.name;
    for (const Contact& contact : motion.contacts) {
      EXPECT_EQ(contact.first_frame, 0);
      EXPECT_EQ(contact.last_frame, motion.clip.frames - 1);
    }
  }
}

}  // namespace
}  // namespace kinespace
