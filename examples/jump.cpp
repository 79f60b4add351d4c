#include <algorithm>
#include <cmath>

#include "examples/performance.h"
#include "examples/posture.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using namespace samples;
using Eigen::Vector2d;

constexpr double longest_jump_reach = 0.955;  // fast knees stay clear of the singular straight leg

// The times and heights of a jump. Heights of the hips are against that of leaving and meeting the floor.
struct JumpPlan {
  explicit JumpPlan(const JumpOptions& options, const Build& build)
      : effort(std::min(1.0, std::sqrt(options.rise_cm / 30))),
        speed(std::sqrt(2 * gravity * options.rise_cm)),
        flight_s(2 * speed / gravity),
        depth((0.19 + 0.0012 * options.rise_cm) * build.standing),
        push_s(1.9 * depth / speed),
        crouch_s(0.30 + 0.10 * depth / (0.15 * build.standing)),
        start(0.35),
        push(start + crouch_s),
        take_off(push + push_s),
        landing(take_off + flight_s),
        lowest(landing + 1.1 * push_s),
        end(lowest + 0.6),
        heading(options.take.heading_deg * degree),
        distance(100 * options.distance_m) {}

  double effort;  // 0 to 1: how far arms and ankles go
  double speed;   // cm/s, upwards, when leaving the floor
  double flight_s;
  double depth;  // cm: how much lower the crouch is than the moment of leaving the floor
  double push_s;
  double crouch_s;
  double start;  // seconds, and so on in order of time
  double push;
  double take_off;
  double landing;
  double lowest;
  double end;
  double heading;
  double distance;  // cm

  [[nodiscard]] double duration_s() const { return end + 0.35; }

  [[nodiscard]] double height(double t, double standing) const {
    const Quintic::State low{-depth, 0, 600};
    if (t < push) return Quintic(start, {standing, 0, 0}, push, low)(std::max(t, start));
    if (t < take_off) return Quintic(push, low, take_off, {0, speed, -gravity})(t);
    if (t < landing) return speed * (t - take_off) - gravity * (t - take_off) * (t - take_off) / 2;
    if (t < lowest) return Quintic(landing, {0, -speed, -gravity}, lowest, low)(t);
    return Quintic(lowest, low, end, {standing, 0, 0})(std::min(t, end));
  }

  // The way of the hips: speeds up in the push, flies on, slows down after the landing.
  [[nodiscard]] double way(double t) const {
    const double all = lowest - push;
    return distance * travel((t - push) / all, push_s / all, (lowest - landing) / all);
  }

  // 0 standing and in the air, 1 in the crouch.
  [[nodiscard]] double crouched(double t) const {
    return Keys({{start, 0}, {push, 1}, {take_off + 0.02, 0}, {landing - 0.05, 0.05}, {lowest, 0.8}, {end, 0}})(t);
  }
};

FootTrack plan_foot(const JumpPlan& plan, const JumpOptions& options, const Build& build, int side) {
  const double rise = options.rise_cm;
  Plant from = standing_plant(build, Vector2d::Zero(), plan.heading, side);
  Plant to = standing_plant(build, plan.distance * forwards(plan.heading), plan.heading, side);
  from.heel_off = plan.push + 0.25 * plan.push_s;
  from.toe_off = plan.take_off;
  from.swing = {.lift = -0.2 * rise,  // the legs hang longer in the air than they push
                .rise = 4,
                .fall = 4,
                .in = 0.3,
                .out = 0.3,
                .peak_pitch = (20 + 42 * plan.effort) * degree,
                .peak_after = 0.12,
                .pitch_ready = 1,
                .flight = rise};
  to.strike = plan.landing;
  to.flat = plan.landing + 0.09;
  to.heel_off = to.toe_off = plan.duration_s() + 100;
  to.strike_pitch = (6 + 18 * plan.effort) * degree;
  return {build.foot, {from, to}};
}

void swing_arms(BodyPose& pose, const JumpPlan& plan, double t) {
  const double flexion = Keys({{plan.start - 0.1, 2},
                               {plan.push - 0.3 * plan.crouch_s, -42},
                               {plan.take_off + 0.4 * plan.flight_s, 125},
                               {plan.landing - 0.15 * plan.flight_s, 95},
                               {plan.lowest + 0.1, 15},
                               {plan.end + 0.1, 2}})(t);
  for (ArmAngles& arm : pose.arms) {
    arm.flexion += plan.effort * flexion * degree;
    arm.elbow += 16 * degree * plan.crouched(t);
  }
}

BodyPose body_at(double t, const JumpPlan& plan, const Stance& stance, const Build& build, double standing) {
  const double crouched = plan.crouched(t);
  const double back = -0.045 * build.standing * crouched;
  BodyPose pose = stance(t, (plan.way(t) + back) * forwards(plan.heading), plan.heading);
  pose.hips.y() = plan.height(t, standing);
  pose.pelvis.pitch += 24 * degree * crouched;
  pose.spine.pitch += 16 * degree * crouched;
  pose.head.pitch -= 28 * degree * crouched;
  swing_arms(pose, plan, t);
  return pose;
}

}  // namespace

void JumpOptions::validate() const {
  take.validate();
  require_range("rise_cm", rise_cm, 10, 60);
  require_range("distance_m", distance_m, 0, 1.2);
}

SampleMotion make_jump(const JumpOptions& options) {
  options.validate();
  const samples::Build build(sample_skeleton(options.take.height_cm));
  const JumpPlan plan(options, build);
  Performance act(options.take, plan.duration_s());
  act.feet = {plan_foot(plan, options, build, 0), plan_foot(plan, options, build, 1)};
  Random random(salted(options.take.seed, "jump"));
  const Stance stance(random, 0.4 * options.take.variation);
  const Liveliness lively(random, 0.6 * options.take.variation);
  const auto with_standing_height = [=](double standing) {
    return [=](double t) { return lively(t, body_at(t, plan, stance, build, standing)); };
  };
  // First as high as pushing, flying and landing let the legs be; then as high as standing does.
  act.body = with_standing_height(0);
  const double in_flight = act.room_above(plan.push, plan.lowest, longest_jump_reach);
  const double standing = std::min(act.room_above(0, plan.start, comfortable_reach),
                                   act.room_above(plan.end, plan.duration_s(), comfortable_reach));
  act.body = with_standing_height(standing - in_flight);
  act.lift_hips(in_flight);
  const std::string style = options.distance_m > 0 ? "forward" : "up";
  return act.perform("jump_" + style, {"jump", style});
}

}  // namespace kinespace
