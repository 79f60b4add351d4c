#include <algorithm>
#include <cmath>

#include "examples/gait.h"
#include "examples/posture.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using namespace samples;

// Knees that straighten at the speed of a run must not come near the singular straight leg.
constexpr double longest_run_reach = 0.98;

// Everything that goes with the pace grows from slow (0) to fast (1).
double pace_of(const RunOptions& options) {
  return std::clamp((equal_speed(options.speed_m_s, options.take) - 1.8) / 2.7, 0.0, 1.1);
}

double cadence_of(const RunOptions& options) {
  const double usual = 140 + 10 * equal_speed(options.speed_m_s, options.take);
  return options.cadence_per_min.value_or(usual / std::sqrt(size_of(options.take)));
}

double at_pace(double slow, double fast, double pace) {
  return slow + (fast - slow) * pace;
}

Gait gait_of(const RunOptions& options, const Build& build) {
  const double pace = pace_of(options);
  Gait gait;
  gait.path = {.heading = options.take.heading_deg * degree,
               .speed = 100 * options.speed_m_s,
               .turn_rate = options.turn_rate_deg_s * degree};
  gait.stride_s = 120 / cadence_of(options);
  gait.phase = options.start_phase;
  gait.toe_off = at_pace(0.32, 0.22, pace);
  gait.flat = 0.05;
  gait.heel_off = gait.flat + 0.4 * (gait.toe_off - gait.flat);
  gait.under = 0.42 * gait.toe_off;
  gait.half_width = 0.35 * build.left_hip.x();
  gait.toe_out = 5 * degree;
  gait.strike_pitch = -6 * degree;
  gait.swing = {.lift = size_of(options.take) * at_pace(7, 19, pace),
                .rise = 3,
                .fall = 4.5,
                .in = 0.45,
                .out = 0.4,
                .peak_pitch = at_pace(64, 92, pace) * degree,
                .peak_after = 0.22,
                .pitch_ready = 0.85,
                .flight = 0};
  return gait;
}

// Height of the hips against that at the strike, cm, `t` seconds after it. In the air the acceleration is -g; on the
// foot it is -g + c sin^2, where c lets the mean over a step vanish.
double bounce(double t, double step_s, double stance_s) {
  const double flight_s = step_s - stance_s;
  const double falling = -gravity * flight_s / 2;  // velocity at the strike
  if (t > stance_s) {
    const double air = t - stance_s;
    return -falling * air - gravity * air * air / 2;
  }
  const double push = 2 * gravity * step_s / stance_s;
  const double turns = 2 * pi / stance_s;
  return falling * t - gravity * t * t / 2 + push * (t * t / 4 - (1 - std::cos(turns * t)) / (2 * turns * turns));
}

void swing_arms(BodyPose& pose, const RunOptions& options, double cycle, double pace) {
  const double amplitude = options.arm_swing * at_pace(24, 40, pace) * degree;
  for (std::size_t side = 0; side < 2; ++side) {
    const double forward = -(side == 0 ? 1 : -1) * std::cos(cycle);
    pose.arms[side] = {.flexion = -8 * degree + amplitude * forward,
                       .abduction = 13 * degree,
                       .twist = -18 * degree,
                       .elbow = at_pace(78, 92, pace) * degree + 0.25 * amplitude * forward,
                       .lift = 2 * degree,
                       .wrist = 5 * degree};
  }
}

BodyPose body_at(double t, const RunOptions& options, const Gait& gait) {
  const double pace = pace_of(options);
  const double cycle = gait.angle(t) + 2 * pi * 0.04;  // pelvis and arms turn back in mid-air
  const double step_s = gait.stride_s / 2;
  const double since_strike = t + gait.phase * gait.stride_s;
  const double step_time = since_strike - step_s * std::floor(since_strike / step_s);
  const double bank = gait.path.bank();
  BodyPose pose;
  const double sway = 0.8 * size_of(options.take) * std::cos(gait.angle(t) - pi * gait.toe_off);
  const Eigen::Vector2d place = gait.path.beside(t, 0, sway);
  pose.hips = {place.x(), bounce(step_time, step_s, gait.toe_off * gait.stride_s), place.y()};
  pose.heading = gait.path.heading_at(t);
  pose.pelvis = {.yaw = -at_pace(5, 10, pace) * degree * std::cos(cycle),
                 .pitch = at_pace(4, 8, pace) * degree,
                 .roll = 3 * degree * std::cos(gait.angle(t) - pi * gait.toe_off) - bank};
  const double chest_yaw = at_pace(5, 9, pace) * degree * std::cos(cycle) * std::min(1.0, options.arm_swing);
  pose.spine = {.yaw = chest_yaw - pose.pelvis.yaw,
                .pitch = at_pace(3, 7, pace) * degree,
                .roll = -0.9 * (pose.pelvis.roll + bank)};
  pose.head = {.yaw = -chest_yaw, .pitch = -at_pace(5, 11, pace) * degree, .roll = 0.5 * bank};
  swing_arms(pose, options, cycle, pace);
  return pose;
}

}  // namespace

void RunOptions::validate() const {
  take.validate();
  require_style(style);
  require_range("speed_m_s", speed_m_s, 1.8, 4.5);
  require_range("turn_rate_deg_s", turn_rate_deg_s, -45, 45);
  if (cadence_per_min) require_range("cadence_per_min", *cadence_per_min, 120, 220);
  require_range("arm_swing", arm_swing, 0, 2);
  require_range("start_phase", start_phase, 0, 1);
  require_range("duration_s", duration_s, 0.1, 600);
  require_step(speed_m_s * 60 / cadence_of(*this), 0.85 * take.height_cm / 100);
}

SampleMotion make_run(const RunOptions& options) {
  options.validate();
  Performance act(options.take, options.duration_s);
  const Gait gait = gait_of(options, act.build);
  Random random(salted(options.take.seed, "run"));
  act.feet = plan_steps(gait, act.build, options.duration_s, random, options.take.variation);
  const Liveliness lively(random, options.take.variation);
  act.body = [=](double t) { return lively(t, body_at(t, options, gait)); };
  act.lift_hips(act.room_above(0, options.duration_s, longest_run_reach));
  return act.perform("run_" + options.style, {"run", options.style});
}

}  // namespace kinespace
