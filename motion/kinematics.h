// Forward kinematics: from local rotations to world positions.
//
//   world(j) = world(parent(j)) * T(translation_j) * R(rotation_j)
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/motion/clip.h"

namespace kinespace {

// World positions in cm: [frame][joint], end sites not included.
struct JointPositions {
  int frames = 0;
  int joints = 0;
  std::vector<Eigen::Vector3d> values;
  [[nodiscard]] const Eigen::Vector3d& at(int frame, int joint) const {
    return values[static_cast<std::size_t>(frame) * static_cast<std::size_t>(joints) + static_cast<std::size_t>(joint)];
  }
};

struct JointFrame {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // joint to world
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            // cm
};

// The world frames of all joints at one frame of the clip; `out` is resized to joint_count().
void world_frames(const Clip& clip, int frame, std::vector<JointFrame>& out);

// World positions of all joints over the whole clip.
[[nodiscard]] JointPositions joint_positions(const Clip& clip);

}  // namespace kinespace
