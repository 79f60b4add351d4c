#include "kinespace/motion/error_measures.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/motion/sample_clips.h"

namespace kinespace::test {
namespace {

constexpr double degree = std::numbers::pi / 180;

// Two joints, 10 cm apart along Y, that slide 4 cm along X from frame 0 to frame 1.
Clip sliding() {
  Skeleton s;
  s.joints.push_back(
      {.name = "a", .offset = {0, 0, 0}, .channels = {Channel::x_rotation, Channel::y_rotation, Channel::z_rotation}});
  s.joints.push_back({.name = "b", .parent = 0, .offset = {0, 10, 0}, .channels = {Channel::z_rotation}});
  Clip clip = make_clip("sliding", s, 30, 2);
  clip.require_translation_track(0).values[1] = {4, 0, 0};
  return clip;
}

Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * degree, axis));
}

TEST(Compare, equal_clips_have_no_error) {
  const Clip clip = random_clip(1, 20);
  const MotionError error = compare(clip, clip);
  EXPECT_EQ(error.joints, 7);
  EXPECT_EQ(error.frames, 20);
  for (const double value : {error.mean_joint_error_cm, error.max_joint_error_cm, error.shell_error_cm,
                             error.mean_rotation_error_deg, error.kg, error.kg_time, error.channel_mse_deg2}) {
    EXPECT_LT(value, 1e-12);
  }
}

TEST(Compare, a_shift_is_a_distance_and_no_rotation) {
  const Clip a = sliding();
  Clip b = a;
  b.translations[0].values[1] += Eigen::Vector3d(0, 3, 4);  // 5 cm in one of two frames
  const MotionError error = compare(a, b);
  EXPECT_DOUBLE_EQ(error.mean_joint_error_cm, 2.5);
  EXPECT_DOUBLE_EQ(error.max_joint_error_cm, 5);
  EXPECT_DOUBLE_EQ(error.shell_error_cm, 2.5);
  EXPECT_EQ(error.mean_rotation_error_deg, 0);
  EXPECT_EQ(error.channel_mse_deg2, 0);
  // ||A - B||^2 = 2 * 25; to the frames' centroids 4 times 5^2; to the joints' means over time 4 times 2^2.
  EXPECT_DOUBLE_EQ(error.kg, 100 * std::sqrt(50.0 / 100));
  EXPECT_DOUBLE_EQ(error.kg_time, 100 * std::sqrt(50.0 / 16));
}

TEST(Compare, a_turn_about_the_bone_moves_the_shell_only) {
  const Clip a = sliding();
  Clip b = a;
  b.set_rotation(0, 0, turn(60, Eigen::Vector3d::UnitY()));
  const MotionError error = compare(a, b);
  EXPECT_NEAR(error.mean_joint_error_cm, 0, 1e-12);
  EXPECT_NEAR(error.shell_error_cm, 3.0 / 2,
              1e-12);  // chord of 60 degrees at 3 cm, on both joints in one of two frames
  EXPECT_NEAR(error.mean_rotation_error_deg, 30, 1e-9);
  EXPECT_NEAR(error.channel_mse_deg2, 60 * 60 / 8.0, 1e-9);  // one of (3 + 1) channels in one of two frames
}

TEST(Compare, a_bend_counts_in_the_joints_below) {
  const Clip a = sliding();
  Clip b = a;
  b.set_rotation(0, 1, turn(90, Eigen::Vector3d::UnitX()));
  const MotionError error = compare(a, b);
  EXPECT_NEAR(error.max_joint_error_cm, 10 * std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(error.mean_joint_error_cm, 10 * std::numbers::sqrt2 / 4, 1e-12);
}

TEST(Compare, whole_turns_and_quaternion_signs_are_no_difference) {
  Clip a = sliding();
  Clip b = a;
  a.set_rotation(0, 0, turn(179, Eigen::Vector3d::UnitX()));
  a.set_rotation(0, 1, turn(181, Eigen::Vector3d::UnitX()));
  b.set_rotation(0, 0, turn(-181, Eigen::Vector3d::UnitX()));
  Eigen::Quaterniond negative = turn(181, Eigen::Vector3d::UnitX());
  negative.coeffs() = -negative.coeffs();
  b.set_rotation(0, 1, negative);
  const MotionError error = compare(a, b);
  EXPECT_NEAR(error.channel_mse_deg2, 0, 1e-15);
  EXPECT_NEAR(error.mean_rotation_error_deg, 0, 1e-6);
}

TEST(Compare, joints_are_matched_by_name_wherever_they_stand) {
  const Clip a = sliding();
  Skeleton s;
  s.joints.push_back({.name = "extra", .offset = {0, -3, 0}});
  s.joints.push_back({.name = "a", .parent = 0, .offset = {0, 3, 1}});
  s.joints.push_back({.name = "c", .parent = 1, .offset = {0, 7, 0}});
  const Clip b = make_clip("other", s, 30, 2);
  const MotionError error = compare(a, b);
  EXPECT_EQ(error.joints, 1);
  EXPECT_DOUBLE_EQ(error.mean_joint_error_cm, (1 + std::sqrt(17.0)) / 2);
}

TEST(Compare, joints_of_equal_names_are_matched_in_their_order) {
  Clip a = sliding();
  a.skeleton.joints[1].name = a.skeleton.joints[0].name;
  EXPECT_EQ(compare(a, a).joints, 2);
  EXPECT_EQ(compare(a, a).mean_joint_error_cm, 0);
}

TEST(Compare, a_reference_that_does_not_vary_gives_no_percentage_of_it) {
  Skeleton s;
  s.joints.push_back({.name = "a"});
  const Clip a = make_clip("still", s, 30, 3);
  EXPECT_EQ(compare(a, a).kg, 0);
  Clip b = a;
  b.skeleton.joints[0].offset = {1, 0, 0};
  EXPECT_EQ(compare(a, b).kg, std::numeric_limits<double>::infinity());
}

TEST(Compare, a_body_far_from_the_origin_loses_no_digits) {
  Clip a = random_clip(4, 100);
  Clip b = random_clip(5, 100);
  const MotionError near = compare(a, b);
  for (Clip* clip : {&a, &b}) {
    for (auto& value : clip->translations[0].values) value += Eigen::Vector3d(1e6, 0, -1e6);
  }
  const MotionError far = compare(a, b);
  EXPECT_NEAR(far.kg_time, near.kg_time, 1e-6 * near.kg_time);
  EXPECT_NEAR(far.kg, near.kg, 1e-6 * near.kg);
}

TEST(Compare, clips_that_cannot_be_compared_are_an_error) {
  const Clip a = sliding();
  EXPECT_THAT(error_of([&] { static_cast<void>(compare(a, slice(a, 0, 1))); }).found, testing::HasSubstr("1 frames"));
  Clip b = a;
  for (auto& joint : b.skeleton.joints) joint.name += "'";
  EXPECT_THAT(error_of([&] { static_cast<void>(compare(a, b)); }).found, testing::HasSubstr("no joint"));
}

}  // namespace
}  // namespace kinespace::test
