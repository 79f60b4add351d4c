#include <algorithm>
#include <cmath>

#include "examples/gait.h"
#include "examples/posture.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using namespace samples;

// Everything that goes with the pace grows from slow (0) to fast (1).
double pace_of(const WalkOptions& options) {
  return std::clamp((equal_speed(options.speed_m_s, options.take) - 0.4) / 1.8, 0.0, 1.1);
}

double mix(double slow, double fast, double pace) {
  return slow + (fast - slow) * pace;
}

double cadence_of(const WalkOptions& options) {
  const double usual = 111 * std::sqrt(equal_speed(options.speed_m_s, options.take) / 1.3);
  return options.cadence_per_min.value_or(usual / std::sqrt(size_of(options.take)));
}

Gait gait_of(const WalkOptions& options, const Build& build) {
  const double pace = pace_of(options);
  Gait gait;
  gait.path = {.heading = options.take.heading_deg * degree,
               .speed = 100 * options.speed_m_s,
               .turn_rate = options.turn_rate_deg_s * degree};
  gait.stride_s = 120 / cadence_of(options);
  gait.phase = options.start_phase;
  gait.flat = mix(0.075, 0.068, pace);
  gait.heel_off = mix(0.34, 0.28, pace);
  gait.toe_off = mix(0.61, 0.57, pace);
  gait.under = mix(0.265, 0.215, pace);
  gait.half_width = mix(0.62, 0.5, pace) * build.left_hip.x();
  gait.strike_pitch = -mix(14, 22, pace) * degree;
  gait.swing = {.lift = size_of(options.take) * mix(2.5, 3.5, pace),
                .rise = 3,
                .fall = 4,
                .in = mix(0.5, 0.45, pace),
                .out = mix(0.3, 0.38, pace),
                .peak_pitch = mix(40, 70, pace) * degree,
                .peak_after = 0.08,
                .pitch_ready = 0.85,
                .flight = 0};
  return gait;
}

void swing_arms(BodyPose& pose, const WalkOptions& options, double cycle, double pace) {
  const double amplitude = options.arm_swing * mix(11, 27, pace) * degree;
  for (std::size_t side = 0; side < 2; ++side) {
    const double forward = -(side == 0 ? 1 : -1) * std::cos(cycle - 0.25);  // opposite to the leg, a little later
    pose.arms[side] = {.flexion = 2 * degree + amplitude * forward,
                       .abduction = 9 * degree,
                       .twist = 0,
                       .elbow = mix(14, 24, pace) * degree + 0.3 * amplitude * (1 + forward),
                       .lift = 0,
                       .wrist = 5 * degree};
  }
}

BodyPose body_at(double t, const WalkOptions& options, const Gait& gait) {
  const double pace = pace_of(options);
  const double cycle = gait.angle(t);            // 0 at the left strike, pi at the right one
  const double support = cycle - 2 * pi * 0.07;  // 0 in the middle of double support
  const double size = size_of(options.take);
  const double sway = size * mix(2.6, 1.6, pace) * std::cos(cycle - 2 * pi * 0.31);  // over the standing foot
  const double surge = size * mix(0.3, 0.9, pace) * std::sin(2 * support);           // fastest in double support
  const double bank = gait.path.bank();
  BodyPose pose;
  const Eigen::Vector2d place = gait.path.beside(t, surge, sway);
  pose.hips = {place.x(), -size * mix(1.2, 3.0, pace) * std::cos(2 * support), place.y()};
  pose.heading = gait.path.heading_at(t);
  pose.pelvis = {.yaw = -mix(3, 8, pace) * degree * std::cos(cycle),
                 .pitch = mix(1, 4, pace) * degree,
                 .roll = mix(2, 4.5, pace) * degree * std::cos(cycle - 2 * pi * 0.18) - bank};
  const double chest_yaw = mix(2, 6, pace) * degree * std::cos(cycle - 0.2) * std::min(1.0, options.arm_swing);
  pose.spine = {.yaw = chest_yaw - pose.pelvis.yaw,
                .pitch = mix(1, 3, pace) * degree + 0.8 * degree * std::cos(2 * support),
                .roll = -0.9 * (pose.pelvis.roll + bank)};
  pose.head = {.yaw = -chest_yaw, .pitch = -mix(1.5, 5, pace) * degree, .roll = 0.5 * bank};
  swing_arms(pose, options, cycle, pace);
  return pose;
}

}  // namespace

void WalkOptions::validate() const {
  take.validate();
  require_style(style);
  require_range("speed_m_s", speed_m_s, 0.4, 2.2);
  require_range("turn_rate_deg_s", turn_rate_deg_s, -60, 60);
  if (cadence_per_min) require_range("cadence_per_min", *cadence_per_min, 40, 200);
  require_range("arm_swing", arm_swing, 0, 2);
  require_range("start_phase", start_phase, 0, 1);
  require_range("duration_s", duration_s, 0.1, 600);
  require_step(speed_m_s * 60 / cadence_of(*this), 0.53 * take.height_cm / 100);
}

SampleMotion make_walk(const WalkOptions& options) {
  options.validate();
  Performance act(options.take, options.duration_s);
  const Gait gait = gait_of(options, act.build);
  Random random(salted(options.take.seed, "walk"));
  act.feet = plan_steps(gait, act.build, options.duration_s, random, options.take.variation);
  const Liveliness lively(random, options.take.variation);
  act.body = [=](double t) { return lively(t, body_at(t, options, gait)); };
  act.lift_hips(act.room_above(0, options.duration_s, longest_reach));
  return act.perform("walk_" + options.style, {"walk", options.style});
}

}  // namespace kinespace
