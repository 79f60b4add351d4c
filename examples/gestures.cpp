// Motions on standing feet: stand, wave, raise.
#include <cmath>

#include "examples/performance.h"
#include "examples/posture.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using namespace samples;

constexpr double height_window_s = 0.25;
constexpr double before_s = 0.35;  // the body stands so long before and after a gesture

bool takes_part(Side wanted, std::size_t side) {
  return wanted == Side::both || (wanted == Side::left ? side == 0 : side == 1);
}

// Stands on both feet and lets `gesture` change the pose.
template <class Gesture>
SampleMotion perform_standing(const TakeOptions& take, double duration_s, double sway, std::string content,
                              std::string style, const Gesture& gesture) {
  Performance act(take, duration_s);
  const double heading = take.heading_deg * degree;
  Random random(salted(take.seed, content));
  const Stance stance(random, sway * take.variation);
  const Liveliness lively(random, std::min(1.0, sway) * take.variation);
  act.feet = standing_feet(act.build, heading);
  act.body = [=](double t) {
    BodyPose pose = lively(t, stance(t, Eigen::Vector2d::Zero(), heading));
    gesture(t, pose);
    return pose;
  };
  act.stand_tall(comfortable_reach, height_window_s);
  return act.perform(content + "_" + style, {content, style});
}

// How far the gesture has begun: 0 before, 1 while it lasts, 0 after.
Keys rise_and_fall(double rise_s, double hold_s) {
  return Keys(
      {{before_s, 0}, {before_s + rise_s, 1}, {before_s + rise_s + hold_s, 1}, {before_s + 2 * rise_s + hold_s, 0}});
}

ArmAngles blend(const ArmAngles& a, const ArmAngles& b, double share) {
  const auto mix = [share](double x, double y) { return x + (y - x) * share; };
  return {.flexion = mix(a.flexion, b.flexion),
          .abduction = mix(a.abduction, b.abduction),
          .twist = mix(a.twist, b.twist),
          .elbow = mix(a.elbow, b.elbow),
          .lift = mix(a.lift, b.lift),
          .wrist = mix(a.wrist, b.wrist)};
}

}  // namespace

void StandOptions::validate() const {
  take.validate();
  require_style(style);
  require_range("duration_s", duration_s, 0.1, 600);
  require_range("sway", sway, 0, 2);
}

SampleMotion make_stand(const StandOptions& options) {
  options.validate();
  return perform_standing(options.take, options.duration_s, options.sway, "stand", options.style,
                          [](double, BodyPose&) {});
}

void WaveOptions::validate() const {
  take.validate();
  require_range("frequency_hz", frequency_hz, 0.5, 3);
  require_range("waves", waves, 1, 50);
}

SampleMotion make_wave(const WaveOptions& options) {
  options.validate();
  constexpr double rise_s = 0.8;
  const double hold_s = options.waves / options.frequency_hz;
  const Keys raised = rise_and_fall(rise_s, hold_s);
  // The waving fades in and out within the first and last half wave.
  const double start = before_s + 0.85 * rise_s;
  const double end = start + hold_s + 0.3 * rise_s;
  const double fade = 0.5 / options.frequency_hz;
  const Keys waving({{start, 0}, {start + fade, 1}, {end - fade, 1}, {end, 0}});
  const auto gesture = [=](double t, BodyPose& pose) {
    const double swing = waving(t) * std::sin(2 * pi * options.frequency_hz * (t - start));
    const ArmAngles up = {.flexion = 12 * degree,
                          .abduction = 82 * degree,
                          .twist = 84 * degree,
                          .elbow = 78 * degree + 26 * degree * swing,
                          .lift = 9 * degree,
                          .wrist = 14 * degree * swing};
    for (std::size_t side = 0; side < 2; ++side) {
      if (!takes_part(options.side, side)) continue;
      pose.arms[side] = blend(pose.arms[side], up, raised(t));
      pose.spine.roll += (side == 0 ? 1 : -1) * 2.5 * degree * raised(t);
    }
  };
  return perform_standing(options.take, 2 * (before_s + rise_s) + hold_s, 1, "wave",
                          std::string(to_string(options.side)), gesture);
}

void RaiseOptions::validate() const {
  take.validate();
  require_range("angle_deg", angle_deg, 30, 175);
  require_range("raise_s", raise_s, 0.4, 5);
  require_range("hold_s", hold_s, 0, 10);
}

SampleMotion make_raise(const RaiseOptions& options) {
  options.validate();
  const Keys raised = rise_and_fall(options.raise_s, options.hold_s);
  const double angle = options.angle_deg * degree;
  // Above the shoulder the girdle turns with the arm.
  const double lift = 22 * degree * smootherstep((angle / degree - 30) / 150);
  const ArmAngles up = {.flexion = options.sideways ? 4 * degree : angle,
                        .abduction = options.sideways ? angle : 6 * degree,
                        .twist = options.sideways ? 60 * degree : 0,
                        .elbow = 7 * degree,
                        .lift = lift,
                        .wrist = 0};
  const auto gesture = [=](double t, BodyPose& pose) {
    const double share = raised(t);
    for (std::size_t side = 0; side < 2; ++side) {
      if (!takes_part(options.side, side)) continue;
      pose.arms[side] = blend(pose.arms[side], up, share);
      pose.spine.pitch -= 2 * degree * share;  // balances the arm
      if (options.side != Side::both) pose.spine.roll += (side == 0 ? 1 : -1) * 3 * degree * share;
    }
    pose.head.pitch -= 5 * degree * share;
  };
  return perform_standing(options.take, 2 * (before_s + options.raise_s) + options.hold_s, 1, "raise",
                          std::string(to_string(options.side)), gesture);
}

}  // namespace kinespace
