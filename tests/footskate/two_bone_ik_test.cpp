// Two-bone inverse kinematics: it reaches, keeps bones and the knee's plane, and is soft near full length.
#include "kinespace/footskate/two_bone_ik.h"

#include <random>

#include <gtest/gtest.h>

namespace kinespace {
namespace {

using Eigen::Vector3d;

const TwoBoneLimb bent{.hip = {0, 90, 0}, .knee = {1, 50, 8}, .ankle = {2, 10, -3}};

TEST(TwoBoneIk, reaches_every_target_within_its_softness) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d way = Vector3d(normal(random), normal(random), normal(random)).normalized();
    const double reach = (0.3 + 0.0006897 * (i % 1000)) * bent.length();
    const Vector3d target = bent.hip + way * reach;
    const TwoBoneTurn turn = reach_for(bent, target);
    EXPECT_LT((turn.ankle - target).norm(), 1e-7 * bent.length());
  }
}

TEST(TwoBoneIk, keeps_the_bones) {
  const TwoBoneTurn turn = reach_for(bent, {20, 30, 25});
  EXPECT_NEAR((turn.knee - bent.hip).norm(), (bent.knee - bent.hip).norm(), 1e-9);
  EXPECT_NEAR((turn.ankle - turn.knee).norm(), (bent.ankle - bent.knee).norm(), 1e-9);
  EXPECT_LT((bent.hip + turn.thigh * (bent.knee - bent.hip) - turn.knee).norm(), 1e-9);
  EXPECT_LT((turn.knee + turn.shin * (bent.ankle - bent.knee) - turn.ankle).norm(), 1e-9);
}

TEST(TwoBoneIk, changes_nothing_for_a_target_where_the_ankle_is) {
  const TwoBoneLimb straight{.hip = {0, 90, 0}, .knee = {0, 48, 0.01}, .ankle = {0, 6, 0}};
  for (const TwoBoneLimb& limb : {bent, straight}) {
    const TwoBoneTurn turn = reach_for(limb, limb.ankle);
    EXPECT_LT(turn.thigh.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
    EXPECT_LT(turn.shin.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
  }
}

TEST(TwoBoneIk, the_knee_stays_in_its_plane_when_the_target_is_in_it) {
  const Vector3d normal = knee_bend(bent).normalized();
  const Vector3d along = (bent.ankle - bent.hip).normalized();
  const Vector3d ahead = normal.cross(along);
  const TwoBoneTurn turn = reach_for(bent, bent.hip + 60 * along + 20 * ahead);
  EXPECT_NEAR(normal.dot(turn.knee - bent.hip), 0, 1e-9);
  EXPECT_GT(ahead.dot(turn.knee - bent.hip) * ahead.dot(bent.knee - bent.hip), 0);  // bends the same way
}

TEST(TwoBoneIk, nears_full_length_softly) {
  const Vector3d way = (bent.ankle - bent.hip).normalized();
  double last = 0;
  double last_step = 0;
  for (int i = 0; i <= 400; ++i) {
    const double wish = (0.95 + 0.0005 * i) * bent.length();
    const double reach = (reach_for(bent, bent.hip + way * wish).ankle - bent.hip).norm();
    EXPECT_LE(reach, bent.length());
    const double step = reach - last;
    if (i > 0) {
      EXPECT_GE(step, -1e-9);
    }
    if (i > 1) {  // ever less
      EXPECT_LE(step, last_step + 1e-6);
    }
    last = reach;
    last_step = step;
  }
  EXPECT_GT(last, 0.999 * bent.length());
}

TEST(TwoBoneIk, bends_a_straight_leg_about_the_axis_given) {
  const TwoBoneLimb straight{.hip = {0, 90, 0}, .knee = {0, 48, 0}, .ankle = {0, 6, 0}};
  const TwoBoneTurn turn = reach_for(straight, {0, 16, 0}, {.knee_axis = Vector3d::UnitX()});
  EXPECT_NEAR((turn.ankle - Vector3d(0, 16, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR(turn.knee.x(), 0, 1e-6);
  EXPECT_GT(std::abs(turn.knee.z()), 5);
}

}  // namespace
}  // namespace kinespace
