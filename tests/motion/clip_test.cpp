#include "kinespace/motion/clip.h"

#include <gtest/gtest.h>

namespace kinespace {
namespace {

Skeleton two_joints() {
  Skeleton s;
  s.joints.push_back({.name = "root",
                      .parent = -1,
                      .offset = {0, 90, 0},
                      .channels = {Channel::x_position, Channel::y_position, Channel::z_position, Channel::z_rotation,
                                   Channel::x_rotation, Channel::y_rotation},
                      .end_site = {}});
  s.joints.push_back({.name = "knee",
                      .parent = 0,
                      .offset = {0, -45, 0},
                      .channels = {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation},
                      .end_site = Eigen::Vector3d(0, -45, 0)});
  return s;
}

TEST(Clip, a_new_clip_rests) {
  const Clip clip = make_clip("rest", two_joints(), 30, 3);
  EXPECT_EQ(clip.rotation(1, 2).coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(clip.translation(1, 0), Eigen::Vector3d(0, -45, 0));
  EXPECT_DOUBLE_EQ(clip.duration_s(), 2.0 / 30);
}

TEST(Clip, a_slice_keeps_the_tracks_of_its_frames) {
  Clip clip = make_clip("c", two_joints(), 30, 5);
  clip.require_translation_track(0).values[3] = {1, 2, 3};
  clip.set_rotation(1, 3, Eigen::Quaterniond(0, 1, 0, 0));
  const Clip part = slice(clip, 2, 2);
  EXPECT_EQ(part.frames, 2);
  EXPECT_EQ(part.translation(0, 1), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(part.rotation(1, 1).x(), 1);
}

TEST(Skeleton, the_height_of_a_standing_rest_pose_is_its_extent) {
  EXPECT_DOUBLE_EQ(two_joints().rest_height(), 90);
}

}  // namespace
}  // namespace kinespace
