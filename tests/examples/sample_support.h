// What the tests of the sample motions share.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "examples/sample_motions.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace::test {

// 72 clips, once for all tests.
inline const std::vector<SampleMotion>& library() {
  static const std::vector<SampleMotion> motions = sample_library();
  return motions;
}

// Motions at the ends of their options, each of them at another height.
inline std::vector<SampleMotion> extremes() {
  std::vector<SampleMotion> out;
  int number = 0;
  const auto add = [&](SampleMotion motion) {
    motion.clip.name += " (extreme " + std::to_string(++number) + ")";
    out.push_back(std::move(motion));
  };
  const TakeOptions usual{.rate_hz = 120, .seed = 11};
  TakeOptions small = usual;
  small.height_cm = 120;
  TakeOptions tall = usual;
  tall.height_cm = 210;
  for (const double turn : {-60.0, 0.0, 60.0}) {
    for (const double speed : {0.4, 1.0, 1.6})
      add(make_walk({.speed_m_s = speed, .turn_rate_deg_s = turn, .take = small}));
    add(make_walk({.speed_m_s = 2.2, .turn_rate_deg_s = turn, .take = usual}));
    add(make_walk({.speed_m_s = 2.2, .turn_rate_deg_s = turn, .take = tall}));
  }
  add(make_walk({.speed_m_s = 1, .cadence_per_min = 70, .take = usual}));
  add(make_walk({.speed_m_s = 1, .cadence_per_min = 200, .arm_swing = 2, .take = usual}));
  for (const double turn : {-45.0, 0.0, 45.0}) {
    for (const double speed : {1.8, 3.3}) add(make_run({.speed_m_s = speed, .turn_rate_deg_s = turn, .take = small}));
    for (const double speed : {1.8, 4.5}) add(make_run({.speed_m_s = speed, .turn_rate_deg_s = turn, .take = usual}));
    for (const double speed : {1.8, 4.5}) add(make_run({.speed_m_s = speed, .turn_rate_deg_s = turn, .take = tall}));
  }
  for (const double angle : {15.0, 75.0, 360.0}) {
    add(make_turn({.side = Side::left, .angle_deg = angle, .step_s = 0.35, .take = small}));
    add(make_turn({.side = Side::right, .angle_deg = angle, .step_s = 1.5, .take = tall}));
  }
  for (const double rise : {10.0, 60.0}) {
    for (const double distance : {0.0, 0.5, 1.2})
      add(make_jump({.rise_cm = rise, .distance_m = distance, .take = usual}));
  }
  add(make_jump({.rise_cm = 40, .distance_m = 0.5, .take = small}));
  add(make_wave({.side = Side::both, .frequency_hz = 3, .waves = 1, .take = small}));
  add(make_raise({.angle_deg = 175, .raise_s = 0.4, .hold_s = 0, .take = tall}));
  add(make_stand({.duration_s = 0.1, .style = "restless", .sway = 2, .take = small}));
  return out;
}

inline const std::vector<SampleMotion>& all_motions() {
  static const std::vector<SampleMotion> motions = [] {
    std::vector<SampleMotion> out = extremes();
    out.insert(out.begin(), library().begin(), library().end());
    return out;
  }();
  return motions;
}

inline int joint(const Clip& clip, const std::string& name) {
  return clip.skeleton.find(name);
}

// A joint's positions over the clip.
inline std::vector<Eigen::Vector3d> path_of(const Clip& clip, const std::string& name) {
  const JointPositions positions = joint_positions(clip);
  std::vector<Eigen::Vector3d> out;
  for (int f = 0; f < clip.frames; ++f) out.push_back(positions.at(f, joint(clip, name)));
  return out;
}

// Degrees, to the left of +Z, of the hips' forward axis.
inline double heading_of(const Clip& clip, int frame) {
  const Eigen::Vector3d ahead = clip.rotation(0, frame) * Eigen::Vector3d::UnitZ();
  return std::atan2(ahead.x(), ahead.z()) * 180 / M_PI;
}

// The smallest angle between two headings in degrees.
inline double apart(double a, double b) {
  return std::abs(std::remainder(a - b, 360.0));
}

// The greatest acceleration of any joint, m/s^2, by second differences.
inline double greatest_acceleration(const Clip& clip) {
  const JointPositions p = joint_positions(clip);
  double out = 0;
  for (int f = 1; f + 1 < clip.frames; ++f) {
    for (int j = 0; j < p.joints; ++j) {
      out = std::max(out, (p.at(f + 1, j) - 2 * p.at(f, j) + p.at(f - 1, j)).norm());
    }
  }
  return out * clip.rate_hz * clip.rate_hz / 100;
}

}  // namespace kinespace::test
