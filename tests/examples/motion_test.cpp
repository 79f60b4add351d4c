// The sample motions do what their options say, in a way a body can.
#include <numbers>

#include <gtest/gtest.h>

#include "tests/examples/sample_support.h"

namespace kinespace {
namespace {

using test::all_motions;
using test::apart;
using test::greatest_acceleration;
using test::heading_of;
using test::joint;
using test::library;
using test::path_of;

constexpr double degrees = 180 / std::numbers::pi;

Eigen::Vector2d on_the_floor(const Eigen::Vector3d& p) {
  return {p.x(), p.z()};
}

// Speed over whole strides of steady travel: the chord of the way, made longer by what an arc of that angle bends.
double speed_of(const Clip& clip, double turn_rate_deg_s) {
  const auto hips = path_of(clip, "Hips");
  const double half = turn_rate_deg_s / degrees * clip.duration_s() / 2;
  const double chord = (on_the_floor(hips.back()) - on_the_floor(hips.front())).norm();
  return chord * (half == 0 ? 1 : half / std::sin(half)) / clip.duration_s() / 100;
}

TEST(SampleWalk, travels_at_the_asked_speed) {
  for (const double speed : {0.4, 0.8, 1.3, 1.8, 2.2}) {
    for (const double heading : {0.0, 90.0, -135.0}) {
      const auto motion = make_walk({.speed_m_s = speed, .duration_s = 3, .take = {.heading_deg = heading}});
      EXPECT_NEAR(speed_of(motion.clip, 0) / speed, 1, 0.01) << speed;
      const auto hips = path_of(motion.clip, "Hips");
      const Eigen::Vector2d way = on_the_floor(hips.back()) - on_the_floor(hips.front());
      EXPECT_LT(apart(std::atan2(way.x(), way.y()) * degrees, heading), 3);
    }
  }
}

TEST(SampleRun, travels_at_the_asked_speed) {
  for (const double speed : {1.8, 3.0, 4.5}) {
    EXPECT_NEAR(speed_of(make_run({.speed_m_s = speed}).clip, 0) / speed, 1, 0.01) << speed;
  }
}

TEST(SampleWalk, an_arc_turns_at_the_asked_rate_and_keeps_the_speed) {
  for (const double rate : {-40.0, 25.0}) {
    // Two strides, so that the sway ends where it began and the pelvis as it began.
    const double strides_s = 2 * 2 * 60.0 / 100;
    const auto walk = make_walk({.speed_m_s = 1.2,
                                 .turn_rate_deg_s = rate,
                                 .cadence_per_min = 100,
                                 .duration_s = strides_s,
                                 .take = {.variation = 0}});
    EXPECT_NEAR(heading_of(walk.clip, walk.clip.frames - 1) - heading_of(walk.clip, 0), rate * strides_s, 1e-6);
    EXPECT_NEAR(speed_of(walk.clip, rate) / 1.2, 1, 0.01);
  }
}

TEST(SampleWalk, steps_at_the_asked_cadence) {
  const auto motion = make_walk({.speed_m_s = 1.2, .cadence_per_min = 120, .duration_s = 5});
  const int foot = joint(motion.clip, "LeftFoot");
  std::vector<int> starts;
  for (const Contact& contact : motion.contacts) {
    if (contact.joint == foot && contact.first_frame > 0) starts.push_back(contact.first_frame);
  }
  ASSERT_GE(starts.size(), 4U);
  for (std::size_t i = 1; i < starts.size(); ++i) EXPECT_NEAR(starts[i] - starts[i - 1], 60, 1);  // a stride a second
}

// Without variation the second half of a stride is the mirror image of the first.
TEST(SampleWalk, left_and_right_mirror_each_other) {
  const double half_stride_s = 0.55;
  const auto motion = make_walk({.cadence_per_min = 60 / half_stride_s,
                                 .duration_s = 2 * half_stride_s,
                                 .take = {.rate_hz = 100, .variation = 0}});
  const JointPositions p = joint_positions(motion.clip);
  const double way = 1.3 * 100 * half_stride_s;
  for (const std::string part : {"Foot", "ToeBase", "Leg", "Hand", "Shoulder"}) {
    const int left = joint(motion.clip, "Left" + part);
    const int right = joint(motion.clip, "Right" + part);
    for (int f = 0; f <= 55; ++f) {
      const Eigen::Vector3d a = p.at(f, left);
      const Eigen::Vector3d b = p.at(f + 55, right);
      EXPECT_LT((Eigen::Vector3d(-a.x(), a.y(), a.z() + way) - b).norm(), 1e-6) << part << " frame " << f;
    }
  }
}

TEST(SampleWalk, arms_swing_against_the_legs_as_far_as_asked) {
  const auto reach = [](double swing) {
    const auto motion = make_walk({.arm_swing = swing, .take = {.variation = 0}});
    const auto hand = path_of(motion.clip, "LeftHand");
    const auto foot = path_of(motion.clip, "LeftFoot");
    const auto hips = path_of(motion.clip, "Hips");
    double together = 0;
    double widest = 0;
    for (std::size_t f = 0; f < hips.size(); ++f) {
      together += (hand[f].z() - hips[f].z()) * (foot[f].z() - hips[f].z());
      widest = std::max(widest, std::abs(hand[f].z() - hips[f].z()));
    }
    return std::pair(together, widest);
  };
  EXPECT_LT(reach(1).first, 0);
  EXPECT_GT(reach(1.5).second, 1.2 * reach(0.5).second);
}

TEST(SampleTurn, ends_as_many_degrees_to_the_side_as_asked) {
  for (const double angle : {30.0, 90.0, 180.0}) {
    for (const Side side : {Side::left, Side::right}) {
      const TakeOptions take{.heading_deg = 20, .variation = 0};
      const auto motion = make_turn({.side = side, .angle_deg = angle, .take = take});
      const double turned = side == Side::left ? angle : -angle;
      EXPECT_LT(apart(heading_of(motion.clip, 0), 20), 1e-6);
      EXPECT_LT(apart(heading_of(motion.clip, motion.clip.frames - 1), 20 + turned), 1e-6);
      EXPECT_LT(path_of(motion.clip, "Hips").back().head<1>().norm(), 5);  // on the spot
      // The shorter way half-way through says which side it went.
      const double middle = std::remainder(heading_of(motion.clip, motion.clip.frames / 2) - 20, 360.0);
      EXPECT_GT(middle * turned, 0);
    }
  }
}

TEST(SampleWave, only_the_waving_hand_goes_above_the_shoulder_and_to_and_fro) {
  for (const Side side : {Side::left, Side::right, Side::both}) {
    const auto motion = make_wave({.side = side, .frequency_hz = 1.5, .waves = 4});
    for (const std::string name : {"Left", "Right"}) {
      const bool waves = side == Side::both || (side == Side::left) == (name == "Left");
      const auto hand = path_of(motion.clip, name + "Hand");
      const auto shoulder = path_of(motion.clip, name + "Arm");
      double highest = -100;
      int reversals = 0;
      double direction = 0;
      for (std::size_t f = 1; f < hand.size(); ++f) {
        highest = std::max(highest, hand[f].y() - shoulder[f].y());
        if (hand[f].y() < shoulder[f].y() + 10) continue;
        const double step = hand[f].x() - hand[f - 1].x();
        reversals += step * direction < 0;
        direction = step;
      }
      EXPECT_EQ(highest > 15, waves) << name;
      EXPECT_EQ(reversals >= 6, waves) << name;
      EXPECT_EQ(highest < -30, !waves) << name;
    }
  }
}

TEST(SampleRaise, only_the_raised_hands_go_above_the_head) {
  for (const bool sideways : {false, true}) {
    for (const Side side : {Side::left, Side::right, Side::both}) {
      const auto motion = make_raise({.side = side, .sideways = sideways});
      const auto head = path_of(motion.clip, "Head");
      for (const std::string name : {"Left", "Right"}) {
        const bool raises = side == Side::both || (side == Side::left) == (name == "Left");
        const auto hand = path_of(motion.clip, name + "Hand");
        double highest = -200;
        double aside = 0;
        double ahead = 0;
        for (std::size_t f = 0; f < hand.size(); ++f) {
          highest = std::max(highest, hand[f].y() - head[f].y());
          aside = std::max(aside, std::abs(hand[f].x()));
          ahead = std::max(ahead, hand[f].z());
        }
        EXPECT_EQ(highest > 10, raises) << name;
        EXPECT_EQ(aside > 60, raises && sideways) << name;
        EXPECT_EQ(ahead > 50, raises && !sideways) << name;
      }
    }
  }
}

// From the last frame on the floor to the top, in the middle of the flight.
TEST(SampleJump, hips_rise_as_asked_and_land_where_asked) {
  for (const double rise : {10.0, 30.0, 50.0}) {
    const auto motion = make_jump({.rise_cm = rise, .distance_m = 0.6, .take = {.rate_hz = 240}});
    const auto hips = path_of(motion.clip, "Hips");
    const int toe = joint(motion.clip, "LeftToeBase");
    const auto contact = std::ranges::find(motion.contacts, toe, &Contact::joint);
    const auto top = std::ranges::max_element(hips, {}, [](const Eigen::Vector3d& p) { return p.y(); });
    EXPECT_NEAR(top->y() - hips[contact->last_frame].y(), rise,
                1.4);  // a frame of 1/240 s at up to 3.1 m/s may lie between
    const auto toes = path_of(motion.clip, "LeftToeBase");
    EXPECT_NEAR(toes.back().z() - toes.front().z(), 60, 1e-9);
  }
}

TEST(SampleJump, hips_fly_a_parabola) {
  const auto motion = make_jump({.rise_cm = 30, .take = {.rate_hz = 240}});
  const auto hips = path_of(motion.clip, "Hips");
  const int toe = joint(motion.clip, "LeftToeBase");
  const auto takeoff = std::ranges::find(motion.contacts, toe, &Contact::joint);
  const int landing = (takeoff + 1)->first_frame;
  ASSERT_GT(landing - takeoff->last_frame, 100);
  for (int f = takeoff->last_frame + 2; f < landing - 1; ++f) {
    EXPECT_NEAR((hips[f + 1].y() - 2 * hips[f].y() + hips[f - 1].y()) * 240 * 240, -981, 0.1);
  }
}

TEST(SampleRun, hips_fall_freely_while_no_foot_pushes) {
  const auto motion = make_run({.speed_m_s = 3, .take = {.rate_hz = 240}});
  const auto hips = path_of(motion.clip, "Hips");
  int falling = 0;
  double strongest = -1e9;
  for (int f = 1; f + 1 < motion.clip.frames; ++f) {
    const double a = (hips[f + 1].y() - 2 * hips[f].y() + hips[f - 1].y()) * 240 * 240;
    EXPECT_GT(a, -981.1);
    falling += a < -980.9;
    strongest = std::max(strongest, a);
  }
  EXPECT_GT(falling, motion.clip.frames / 4);
  EXPECT_GT(strongest, 1500);  // the push of a stance carries more than twice the weight
}

// Knees and elbows are hinges: bones stay in the plane of the limb and bend one way only.
TEST(SampleBody, knees_bend_forwards_and_elbows_inwards) {
  for (const SampleMotion& motion : all_motions()) {
    for (const std::string side : {"Left", "Right"}) {
      double off_axis = 0;
      double knee_low = 360, knee_high = -360, elbow_low = 360, elbow_high = -360;
      for (int f = 0; f < motion.clip.frames; ++f) {
        const auto knee = motion.clip.rotation(joint(motion.clip, side + "Leg"), f);
        const auto elbow = motion.clip.rotation(joint(motion.clip, side + "ForeArm"), f);
        off_axis =
            std::max({off_axis, std::abs(knee.y()), std::abs(knee.z()), std::abs(elbow.x()), std::abs(elbow.z())});
        const double bend = 2 * std::atan(knee.x() / knee.w()) * degrees;
        const double flex = 2 * std::atan(elbow.y() / elbow.w()) * degrees * (side == "Left" ? -1 : 1);
        knee_low = std::min(knee_low, bend), knee_high = std::max(knee_high, bend);
        elbow_low = std::min(elbow_low, flex), elbow_high = std::max(elbow_high, flex);
      }
      EXPECT_LT(off_axis, 1e-9) << motion.clip.name;
      EXPECT_GT(knee_low, 8) << motion.clip.name;
      EXPECT_LT(knee_high, 155) << motion.clip.name;
      EXPECT_GT(elbow_low, 0) << motion.clip.name;
      EXPECT_LT(elbow_high, 150) << motion.clip.name;
    }
  }
}

// The same in the world: the knee is before the line from hip to ankle, the fist of a runner before the elbow.
TEST(SampleBody, knees_point_where_the_body_faces) {
  for (const SampleMotion& motion : all_motions()) {
    const JointPositions p = joint_positions(motion.clip);
    const auto at = [&](int f, const std::string& name) { return p.at(f, joint(motion.clip, name)); };
    double knee_ahead = 100;
    double fist_ahead = 100;
    for (int f = 0; f < motion.clip.frames; ++f) {
      const Eigen::Vector3d front = motion.clip.rotation(0, f) * Eigen::Vector3d::UnitZ();
      for (const std::string side : {"Left", "Right"}) {
        const Eigen::Vector3d leg = (at(f, side + "Foot") - at(f, side + "UpLeg")).normalized();
        const Eigen::Vector3d knee = at(f, side + "Leg") - at(f, side + "UpLeg");
        knee_ahead = std::min(knee_ahead, (knee - knee.dot(leg) * leg).dot(front));
        fist_ahead = std::min(fist_ahead, (at(f, side + "Hand") - at(f, side + "ForeArm")).dot(front));
      }
    }
    EXPECT_GT(knee_ahead, 2) << motion.clip.name;
    EXPECT_TRUE(motion.labels.front() != "run" || fist_ahead > 5) << motion.clip.name;
  }
}

TEST(SampleBody, bones_keep_their_length) {
  for (const SampleMotion& motion : library()) {
    const JointPositions p = joint_positions(motion.clip);
    double change = 0;
    for (int j = 1; j < p.joints; ++j) {
      const Joint& bone = motion.clip.skeleton.joints[j];
      for (int f = 0; f < p.frames; ++f) {
        change = std::max(change, std::abs((p.at(f, j) - p.at(f, bone.parent)).norm() - bone.offset.norm()));
      }
    }
    EXPECT_LT(change, 1e-9) << motion.clip.name;
  }
}

TEST(SampleBody, rotations_are_unit_and_continuous) {
  for (const SampleMotion& motion : all_motions()) {
    for (int j = 0; j < motion.clip.skeleton.joint_count(); ++j) {
      double worst = 1;
      for (int f = 0; f < motion.clip.frames; ++f) {
        ASSERT_NEAR(motion.clip.rotation(j, f).norm(), 1, 1e-12);
        if (f > 0) worst = std::min(worst, motion.clip.rotation(j, f).dot(motion.clip.rotation(j, f - 1)));
      }
      EXPECT_GT(worst, std::cos(0.5 * 30 / degrees)) << motion.clip.name << " joint " << j;  // 30 degrees a frame
    }
  }
}

// m/s^2. Measured on people: feet in walking 30 to 60, in running above 100, hands in a jump 100 to 150.
TEST(SampleBody, accelerations_stay_within_what_bodies_do) {
  for (const SampleMotion& motion : library()) {
    const std::string& content = motion.labels.front();
    const double bound = content == "walk" ? 90 : content == "run" ? 100 : content == "jump" ? 190 : 40;
    EXPECT_LT(greatest_acceleration(motion.clip), bound) << motion.clip.name;
  }
}

// Where the velocity jumps, second differences grow with the rate; where it does not, they settle.
TEST(SampleBody, velocities_have_no_jumps) {
  const auto growth = [](const auto& make) {
    return greatest_acceleration(make(960).clip) / greatest_acceleration(make(240).clip);
  };
  const auto at = [](double rate) { return TakeOptions{.rate_hz = rate, .seed = 5}; };
  EXPECT_LT(growth([&](double r) { return make_walk({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_walk({.turn_rate_deg_s = 50, .take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_run({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_turn({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_wave({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_raise({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_jump({.take = at(r)}); }), 1.1);
  EXPECT_LT(growth([&](double r) { return make_stand({.take = at(r)}); }), 1.1);
}

TEST(SampleBody, the_rate_only_samples_the_same_motion) {
  const auto coarse = make_walk({.take = {.rate_hz = 30}});
  const auto fine = make_walk({.take = {.rate_hz = 120}});
  const JointPositions a = joint_positions(coarse.clip);
  const JointPositions b = joint_positions(fine.clip);
  ASSERT_EQ(4 * (a.frames - 1), b.frames - 1);
  for (int f = 0; f < a.frames; ++f) {
    for (int j = 0; j < a.joints; ++j) EXPECT_LT((a.at(f, j) - b.at(4 * f, j)).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace kinespace
