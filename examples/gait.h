// What walks and runs share: the path, and footsteps along it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "examples/body.h"
#include "examples/performance.h"

namespace kinespace::samples {

// The share of a 175 cm body's measures, and the speed at which that body moves in the same manner (equal Froude
// numbers v^2 / (g h), Alexander and Jayes 1983); times scale with the root of the size.
[[nodiscard]] inline double size_of(const TakeOptions& take) {
  return take.height_cm / 175;
}
[[nodiscard]] inline double equal_speed(double speed_m_s, const TakeOptions& take) {
  return speed_m_s / std::sqrt(size_of(take));
}

// The way of the hips: a line or an arc from the origin, travelled at constant speed.
struct Path {
  double heading = 0;    // radians, at t = 0
  double speed = 0;      // cm/s
  double turn_rate = 0;  // radians/s
  [[nodiscard]] double heading_at(double t) const { return heading + turn_rate * t; }
  [[nodiscard]] Eigen::Vector2d point(double t) const;
  // `side` cm to the left of the path and `ahead` cm further than at t.
  [[nodiscard]] Eigen::Vector2d beside(double t, double ahead, double side) const;
  // The lean into the turn that balances weight and centrifugal force, radians; positive to the left.
  [[nodiscard]] double bank() const;
};

// Times as shares of the stride (two steps), from the strike of a foot.
struct Gait {
  Path path;
  double stride_s = 1;
  double phase = 0;  // the share of the stride that has passed since the left strike at t = 0
  double flat = 0.08;
  double heel_off = 0.35;
  double toe_off = 0.6;
  double under = 0.28;    // when the hips pass over the ankle
  double half_width = 5;  // cm, ankle from the path
  double toe_out = 7 * degree;
  double strike_pitch = 0;
  Swing swing;
  [[nodiscard]] double angle(double t) const { return 2 * pi * (t / stride_s + phase); }
};

// Footsteps for [0, duration_s] and a stride to both sides; chance moves them by up to a centimetre times `variation`.
[[nodiscard]] std::vector<FootTrack> plan_steps(const Gait& gait, const Build& build, double duration_s, Random& random,
                                                double variation);

// Throws Error{usage} for steps, in m, that legs of that size do not make.
void require_step(double step_m, double longest_m);

}  // namespace kinespace::samples
