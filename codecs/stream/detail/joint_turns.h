// One joint's rotations as the angles that its freedom leaves (codecs/stream/joint_channels.h), and back.
#pragma once

#include <span>
#include <vector>

#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/motion/euler.h"

namespace kinespace {

// Rz Ry Rx.
inline constexpr EulerOrder zyx{.axes = {2, 1, 0}, .given = 3};

class JointTurns {
 public:
  explicit JointTurns(const JointFreedom& freedom);

  [[nodiscard]] std::size_t turns() const { return static_cast<std::size_t>(freedom_.turns); }
  // [turn][frame] degrees, continuous.
  void angles(std::span<const Eigen::Quaterniond> rotations, std::span<double> out) const;
  // The way back, with the same bits on every machine.
  void rotations(std::span<const double> angles, std::span<Eigen::Quaterniond> out) const;

 private:
  [[nodiscard]] EulerAngles angles_of(const Eigen::Quaterniond& rotation, const EulerAngles* near) const;
  JointFreedom freedom_;
  Eigen::Quaterniond before_;
  Eigen::Quaterniond after_;
};

// The joint's rotations in all frames of a clip, behind those in `out`: the travel root's in the world, the others'
// in their parents. Throws Error{bad_input} when one is no unit quaternion.
void append_turns(const Clip& clip, int joint, std::vector<Eigen::Quaterniond>& out);

}  // namespace kinespace
