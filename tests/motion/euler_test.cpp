#include "kinespace/motion/euler.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

constexpr double radian = std::numbers::pi / 180;

std::vector<std::vector<Channel>> all_orders() {
  using enum Channel;
  return {{x_rotation, y_rotation, z_rotation}, {x_rotation, z_rotation, y_rotation},
          {y_rotation, x_rotation, z_rotation}, {y_rotation, z_rotation, x_rotation},
          {z_rotation, x_rotation, y_rotation}, {z_rotation, y_rotation, x_rotation}};
}

Eigen::Quaterniond product(const EulerOrder& order, const EulerAngles& angles) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < 3; ++i)
    q = q * Eigen::AngleAxisd(angles[i] * radian, Eigen::Vector3d::Unit(order.axes[i]));
  return q;
}

Eigen::Quaterniond quaternion(const EulerOrder& order, const EulerAngles& angles) {
  double q[4];
  quaternions_from_euler(order, &angles[0], &angles[1], &angles[2], 1, q);
  return {q[0], q[1], q[2], q[3]};
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

TEST(Euler, quaternions_are_the_product_of_the_channels_from_left_to_right) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> degrees(-720, 720);
  for (const auto& channels : all_orders()) {
    const EulerOrder order = euler_order(channels);
    constexpr std::size_t count = 333;  // neither a block nor a multiple of one
    std::vector<double> a(count), b(count), c(count), q(4 * count);
    for (std::size_t i = 0; i < count; ++i) {
      a[i] = degrees(random);
      b[i] = degrees(random);
      c[i] = degrees(random);
    }
    quaternions_from_euler(order, a.data(), b.data(), c.data(), count, q.data());
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Quaterniond got(q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]);
      const Eigen::Quaterniond want = product(order, {a[i], b[i], c[i]});
      ASSERT_LT((got.coeffs() - want.coeffs()).norm(), 2e-15 * 8) << i;
    }
  }
}

TEST(Euler, right_angles_and_whole_turns_are_exact) {
  const EulerOrder order = euler_order(all_orders()[0]);
  for (int turns = -5; turns <= 5; ++turns) {
    const double whole = turns * 720.0;
    EXPECT_EQ(quaternion(order, {whole, 0, 0}).coeffs(), Eigen::Quaterniond::Identity().coeffs());
    EXPECT_NEAR(quaternion(order, {whole + 180, 0, 0}).x(), 1, 1e-16);
    EXPECT_EQ(quaternion(order, {whole + 360, 0, 0}).w(), -1);
  }
}

TEST(Euler, angles_of_a_billion_degrees_are_still_accurate) {
  const EulerOrder order = euler_order(all_orders()[3]);
  const EulerAngles angles = {1e9 - 77.25, -1e9 + 13.5, 123456789.125};
  const EulerAngles reduced = {std::fmod(angles[0], 720), std::fmod(angles[1], 720), std::fmod(angles[2], 720)};
  EXPECT_LT((quaternion(order, angles).coeffs() - product(order, reduced).coeffs()).norm(), 1e-14);
}

TEST(Euler, continuous_angles_give_continuous_quaternions) {
  const EulerOrder order = euler_order(all_orders()[4]);
  Eigen::Quaterniond before = quaternion(order, {-1000, -1000, -1000});
  for (int step = -2000; step <= 2000; ++step) {
    const double a = 0.5 * step;
    const Eigen::Quaterniond q = quaternion(order, {a, a, a});
    ASSERT_LT((q.coeffs() - before.coeffs()).norm(), 0.02);
    before = q;
  }
}

TEST(Euler, angles_go_to_quaternions_and_back_in_every_order) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (const auto& channels : all_orders()) {
    const EulerOrder order = euler_order(channels);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Quaterniond q =
          Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
      const EulerAngles angles = euler_angles(order, q);
      ASSERT_LE(std::abs(angles[1]), 90 + 1e-12);
      ASSERT_LE(std::abs(angles[0]), 180 + 1e-12);
      ASSERT_LT(angle_between(q, product(order, angles)), 1e-14 * 4);
      const EulerAngles near = {normal(random) * 500, normal(random) * 500, normal(random) * 500};
      ASSERT_LT(angle_between(q, product(order, euler_angles(order, q, near))), 1e-12);
    }
  }
}

TEST(Euler, a_smooth_motion_through_gimbal_lock_keeps_smooth_angles) {
  for (const auto& channels : all_orders()) {
    const EulerOrder order = euler_order(channels);
    EulerAngles near = {30, 60, -40};
    for (int f = 0; f <= 600; ++f) {  // the middle angle passes +90, +270, +450, each exactly
      const EulerAngles truth = {30 + 0.1 * f, 60.0 + f, -40 - 0.2 * f};
      const EulerAngles angles = euler_angles(order, product(order, truth), near);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(angles[c], truth[c], 0.5) << "frame " << f << " channel " << c;
      near = angles;
    }
  }
}

TEST(Euler, at_gimbal_lock_the_first_angle_rests_and_the_rotation_is_kept) {
  for (const auto& channels : all_orders()) {
    const EulerOrder order = euler_order(channels);
    for (const double pitch : {90.0, -90.0}) {
      const EulerAngles near = {25, pitch, 10};
      const Eigen::Quaterniond q = product(order, {60, pitch, -20});
      const EulerAngles angles = euler_angles(order, q, near);
      EXPECT_NEAR(angles[0], 25, 1e-6);
      EXPECT_NEAR(angles[1], pitch, 1e-6);
      EXPECT_LT(angle_between(q, product(order, angles)), 1e-8);
    }
  }
}

TEST(Euler, noise_around_gimbal_lock_moves_the_rotation_no_more_than_the_noise) {
  std::mt19937 random(4);
  for (const double size : {1e-16, 1e-12, 1e-9, 1e-8, 1e-6}) {
    std::normal_distribution<double> noise(0, size);
    const EulerOrder order = euler_order(all_orders()[5]);
    EulerAngles near = {10, 90, 0};
    for (int i = 0; i < 500; ++i) {
      Eigen::Quaterniond q = product(order, {10, 90, 0});
      q.coeffs() += Eigen::Vector4d(noise(random), noise(random), noise(random), noise(random));
      q.normalize();
      near = euler_angles(order, q, near);
      ASSERT_LT(angle_between(q, product(order, near)), 5e-8);
    }
  }
}

TEST(Euler, the_order_of_fewer_channels_is_completed) {
  using enum Channel;
  const std::vector<Channel> two = {y_rotation, x_position, x_rotation};
  const EulerOrder order = euler_order(two);
  EXPECT_EQ(order.given, 2);
  EXPECT_EQ(order.axes, (std::array<int, 3>{1, 0, 2}));
  EXPECT_EQ(euler_order({}).given, 0);
}

Clip one_joint(std::vector<Channel> channels, const std::vector<Eigen::Quaterniond>& rotations) {
  Skeleton s;
  s.joints.push_back({.name = "j", .offset = {1, 2, 3}, .channels = std::move(channels)});
  Clip clip = make_clip("c", s, 30, static_cast<int>(rotations.size()));
  for (int f = 0; f < clip.frames; ++f) clip.set_rotation(0, f, rotations[static_cast<std::size_t>(f)]);
  return clip;
}

TEST(ChannelsToWrite, are_the_joints_own_where_these_suffice) {
  using enum Channel;
  const EulerOrder order = euler_order(std::vector<Channel>{y_rotation, x_rotation});
  for (const EulerAngles& angles :
       {EulerAngles{170, 100, 0}, EulerAngles{20, 90, 0}, EulerAngles{-20, -90, 0}, EulerAngles{0, 200, 0}}) {
    const Clip clip = one_joint({y_rotation, x_rotation}, {product(order, angles)});
    EXPECT_EQ(channels_to_write(clip, 0), (std::vector<Channel>{y_rotation, x_rotation}))
        << angles[0] << " " << angles[1];
  }
  const Clip turned = one_joint({z_rotation}, {Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitZ()))});
  EXPECT_EQ(channels_to_write(turned, 0), (std::vector<Channel>{z_rotation}));
}

TEST(ChannelsToWrite, grow_where_the_motion_needs_it) {
  using enum Channel;
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  EXPECT_EQ(channels_to_write(one_joint({y_rotation}, {tilted}), 0),
            (std::vector<Channel>{y_rotation, z_rotation, x_rotation}));
  EXPECT_EQ(channels_to_write(one_joint({}, {tilted}), 0), (std::vector<Channel>{z_rotation, x_rotation, y_rotation}));
  Clip moving = one_joint({z_rotation}, {Eigen::Quaterniond::Identity()});
  moving.require_translation_track(0);
  EXPECT_EQ(channels_to_write(moving, 0), (std::vector<Channel>{x_position, y_position, z_position, z_rotation}));
  const Clip partly =
      one_joint({y_position}, {Eigen::Quaterniond::Identity()});  // rests at x = 1, where y alone cannot put it
  EXPECT_EQ(channels_to_write(partly, 0), (std::vector<Channel>{y_position, x_position, z_position}));
}

}  // namespace
}  // namespace kinespace
