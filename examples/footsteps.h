// Where a foot stands and how it gets there.
//
// A plant runs strike -> flat -> heel off -> toe off. From strike to flat the foot turns about its heel (strike pitch
// negative) or about its ball (positive); then it stands; from heel off it turns about its ball until toe off.
// Everything is twice continuously differentiable in time, and exactly constant where it stands.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace kinespace::samples {

// cm, of a flat foot.
struct FootShape {
  double ankle_height;   // ankle above the sole
  double ankle_to_toe;   // forwards, along the sole
  double heel_to_ankle;  // forwards, along the sole
  double toe_length;     // from the ball to the tip
};

struct FootPose {
  Eigen::Vector3d toe = Eigen::Vector3d::Zero();  // cm, world: the toe joint
  double yaw = 0;                                 // radians, world
  double pitch = 0;                               // radians; positive: heel higher than toes
  double toe_bend = 0;                            // radians; by so much the toes point higher than the foot
  [[nodiscard]] Eigen::Quaterniond rotation() const;
  [[nodiscard]] Eigen::Vector3d ankle(const FootShape& shape) const;
};

// The way from a plant to the next.
struct Swing {
  double lift = 3;  // cm: how high the arc lifts the toe joint
  double rise = 3;  // powers of the arc's shape: its top is at rise / (rise + fall) of the time
  double fall = 3;
  double in = 0.5;  // shares of the time to gain and lose speed (smooth.h, travel)
  double out = 0.5;
  double peak_pitch = 0;    // radians, the highest, shortly after toe off
  double peak_after = 0.1;  // share of the swing's time
  double pitch_ready = 1;   // share of the time at which the strike pitch is reached
  double flight = 0;        // cm: height of a parabola added to the arc, for jumps
};

struct Plant {
  Eigen::Vector2d toe = Eigen::Vector2d::Zero();  // cm, world x and z of the toe joint
  double yaw = 0;                                 // radians
  double strike = 0;                              // seconds: strike <= flat <= heel_off <= toe_off
  double flat = 0;
  double heel_off = 0;
  double toe_off = 0;
  double strike_pitch = 0;  // radians
  Swing swing;              // that follows
};

// When a joint of a foot stands still, seconds.
struct Stand {
  bool toe;  // the toe joint, else the ankle
  double first;
  double last;
};

class FootTrack {
 public:
  // `plants` in order of time, at least one; the foot stands in the first one since ever, in the last one for ever.
  FootTrack(const FootShape& shape, std::vector<Plant> plants) : shape_(shape), plants_(std::move(plants)) {}
  [[nodiscard]] FootPose at(double t) const;
  [[nodiscard]] std::vector<Stand> stands() const;

 private:
  [[nodiscard]] FootPose planted(const Plant& plant, double t) const;
  [[nodiscard]] FootPose swinging(const Plant& from, const Plant& to, double t) const;
  [[nodiscard]] double pitch_between(const Plant& from, const Plant& to, double t) const;

  FootShape shape_;
  std::vector<Plant> plants_;
};

// Forwards of a heading in the plane: (sin, cos) as (x, z).
[[nodiscard]] inline Eigen::Vector2d forwards(double heading) {
  return {std::sin(heading), std::cos(heading)};
}
// To the left of a heading.
[[nodiscard]] inline Eigen::Vector2d leftwards(double heading) {
  return {std::cos(heading), -std::sin(heading)};
}

}  // namespace kinespace::samples
