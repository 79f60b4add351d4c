#include "examples/footsteps.h"

#include <algorithm>
#include <limits>

#include "examples/smooth.h"

namespace kinespace::samples {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

Eigen::Quaterniond FootPose::rotation() const {
  return AngleAxisd(yaw, Vector3d::UnitY()) * AngleAxisd(pitch, Vector3d::UnitX());
}

Vector3d FootPose::ankle(const FootShape& shape) const {
  return toe + rotation() * Vector3d(0, shape.ankle_height, -shape.ankle_to_toe);
}

FootPose FootTrack::at(double t) const {
  const auto after = std::ranges::upper_bound(plants_, t, {}, &Plant::strike);
  if (after == plants_.begin()) return planted(plants_.front(), plants_.front().flat);
  const Plant& plant = *(after - 1);
  if (after == plants_.end()) return planted(plant, std::min(t, plant.heel_off));
  if (t < plant.flat) return planted(plant, t);
  return t < plant.toe_off ? planted(plant, t) : swinging(plant, *after, t);
}

// Heel off to the strike of the next plant.
double FootTrack::pitch_between(const Plant& from, const Plant& to, double t) const {
  const double peak = from.toe_off + from.swing.peak_after * (to.strike - from.toe_off);
  const double high = from.swing.peak_pitch;
  if (t <= peak) return high * smootherstep((t - from.heel_off) / (peak - from.heel_off));
  const double ready = from.toe_off + from.swing.pitch_ready * (to.strike - from.toe_off);
  return high + (to.strike_pitch - high) * smootherstep((t - peak) / (ready - peak));
}

FootPose FootTrack::planted(const Plant& plant, double t) const {
  FootPose pose{.toe = {plant.toe.x(), 0, plant.toe.y()}, .yaw = plant.yaw, .pitch = 0, .toe_bend = 0};
  if (t >= plant.flat && t <= plant.heel_off) return pose;
  if (t > plant.heel_off) {
    pose.pitch = pitch_between(plant, *(&plant + 1), t);
    pose.toe_bend = pose.pitch;  // the toes stay on the floor
    return pose;
  }
  pose.pitch = plant.strike_pitch * (1 - smootherstep((t - plant.strike) / (plant.flat - plant.strike)));
  if (plant.strike_pitch > 0) {
    pose.toe_bend = pose.pitch;
  } else {  // about the heel, which stands where it will
    const double sole = shape_.heel_to_ankle + shape_.ankle_to_toe;
    const Eigen::Vector2d back = forwards(plant.yaw) * (sole * (std::cos(pose.pitch) - 1));
    pose.toe += Vector3d(back.x(), -sole * std::sin(pose.pitch), back.y());
  }
  return pose;
}

FootPose FootTrack::swinging(const Plant& from, const Plant& to, double t) const {
  const Swing& swing = from.swing;
  const double u = (t - from.toe_off) / (to.strike - from.toe_off);
  const Eigen::Vector2d way = from.toe + (to.toe - from.toe) * travel(u, swing.in, swing.out);
  FootPose pose;
  pose.yaw = from.yaw + (to.yaw - from.yaw) * smootherstep(u);
  pose.pitch = pitch_between(from, to, t);
  pose.toe = {way.x(), swing.lift * bump(u, swing.rise, swing.fall), way.y()};
  if (swing.flight > 0) {
    constexpr double ease = 0.19;  // the share of the flight in which the foot catches up with the parabola
    pose.toe.y() += 4 * swing.flight * u * (1 - u) * smootherstep(u / ease) * smootherstep((1 - u) / ease);
  }
  double flat_toes = 1 - smootherstep(u / 0.75);
  if (to.strike_pitch > 0) {
    flat_toes += smootherstep((u - 0.5) / 0.5);
  } else {  // change over from the ball to the heel as the point that the arc leads
    constexpr double early = 12 * degree;
    const double about_heel = smootherstep((early - pose.pitch) / (early - to.strike_pitch / 2));
    const double sole = shape_.heel_to_ankle + shape_.ankle_to_toe;
    const Eigen::Vector2d back = forwards(pose.yaw) * (about_heel * sole * (std::cos(pose.pitch) - 1));
    pose.toe += Vector3d(back.x(), -about_heel * sole * std::sin(pose.pitch), back.y());
  }
  pose.toe_bend = pose.pitch * flat_toes;
  return pose;
}

std::vector<Stand> FootTrack::stands() const {
  constexpr double ever = std::numeric_limits<double>::infinity();
  std::vector<Stand> out;
  for (const bool toe : {false, true}) {
    for (std::size_t i = 0; i < plants_.size(); ++i) {
      const Plant& plant = plants_[i];
      const double first = i == 0 ? -ever : (toe && plant.strike_pitch > 0 ? plant.strike : plant.flat);
      const double last = i + 1 == plants_.size() ? ever : (toe ? plant.toe_off : plant.heel_off);
      out.push_back({toe, first, last});
    }
  }
  return out;
}

}  // namespace kinespace::samples
