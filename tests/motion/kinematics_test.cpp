#include "kinespace/motion/kinematics.h"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "kinespace/motion/position_blocks.h"
#include "tests/motion/sample_clips.h"

namespace kinespace::test {
namespace {

// The formula of the header, written out.
JointFrame world_frame(const Clip& clip, int joint, int frame) {
  const int parent = clip.skeleton.joints[static_cast<std::size_t>(joint)].parent;
  const Eigen::Quaterniond q = clip.rotation(joint, frame);
  if (parent < 0) return {q, clip.translation(joint, frame)};
  const JointFrame above = world_frame(clip, parent, frame);
  return {above.rotation * q, above.position + above.rotation * clip.translation(joint, frame)};
}

TEST(Kinematics, positions_are_the_product_of_the_transforms_above_for_clips_of_every_length) {
  for (const int frames : {1, 2, 31, 32, 33, 64, 65, 200}) {
    const Clip clip = random_clip(static_cast<std::uint32_t>(frames), frames);
    const JointPositions positions = joint_positions(clip);
    ASSERT_EQ(positions.frames, frames);
    ASSERT_EQ(positions.joints, clip.skeleton.joint_count());
    ASSERT_EQ(positions.values.size(), static_cast<std::size_t>(frames * positions.joints));
    for (int f = 0; f < frames; ++f) {
      for (int j = 0; j < positions.joints; ++j) {
        ASSERT_LT((positions.at(f, j) - world_frame(clip, j, f).position).norm(), 1e-11) << f << " " << j;
      }
    }
  }
}

TEST(Kinematics, blocks_hand_over_every_frame_and_begin_with_what_they_overlap) {
  for (const int frames : {1, 2, 511, 512, 513, 514, 1025}) {
    const Clip clip = random_clip(5, frames);
    const JointPositions whole = joint_positions(clip);
    for (const int overlap : {0, 2}) {
      int next = 0;
      for_each_position_block(clip, overlap, [&](int first, const JointPositions& block) {
        EXPECT_EQ(first, std::max(0, next - overlap)) << frames;
        for (int f = 0; f < block.frames; ++f) {
          for (int j = 0; j < block.joints; ++j) ASSERT_EQ(block.at(f, j), whole.at(first + f, j)) << frames;
        }
        next = first + block.frames;
      });
      EXPECT_EQ(next, frames);
    }
  }
}

TEST(Kinematics, world_frames_and_joint_positions_agree) {
  const Clip clip = random_clip(7, 50);
  const JointPositions positions = joint_positions(clip);
  std::vector<JointFrame> frames;
  for (int f = 0; f < clip.frames; ++f) {
    world_frames(clip, f, frames);
    ASSERT_EQ(frames.size(), clip.skeleton.joints.size());
    for (int j = 0; j < positions.joints; ++j) {
      const JointFrame& got = frames[static_cast<std::size_t>(j)];
      ASSERT_LT((positions.at(f, j) - got.position).norm(), 1e-11);
      ASSERT_LT(got.rotation.angularDistance(world_frame(clip, j, f).rotation), 1e-7);
    }
  }
}

TEST(Kinematics, a_bent_knee_puts_the_foot_where_geometry_says) {
  Skeleton s;
  s.joints.push_back({.name = "hip", .offset = {0, 90, 0}});
  s.joints.push_back({.name = "knee", .parent = 0, .offset = {0, -45, 0}});
  s.joints.push_back({.name = "foot", .parent = 1, .offset = {0, -45, 0}});
  Clip clip = make_clip("bend", s, 30, 1);
  clip.set_rotation(1, 0, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX())));
  EXPECT_LT((joint_positions(clip).at(0, 2) - Eigen::Vector3d(0, 45, -45)).norm(), 1e-12);
}

TEST(Kinematics, bones_keep_their_length) {
  const Clip clip = random_clip(9, 40);
  const JointPositions positions = joint_positions(clip);
  for (int f = 0; f < clip.frames; ++f) {
    for (const int j : {1, 2, 4, 5, 6}) {
      const Joint& joint = clip.skeleton.joints[static_cast<std::size_t>(j)];
      ASSERT_NEAR((positions.at(f, j) - positions.at(f, joint.parent)).norm(), joint.offset.norm(), 1e-11);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
