// Where the body is and how it faces, taken out of the motion before its postures are compared (lin2011, section 3).
//
// Four degrees of freedom, the position of the travel root and its heading, are taken out of motion on the feet. Motion
// that tumbles (somersaults, breakdance, hanging upside down) has all six taken out: the tilt too. Which of the two is
// chosen for each clip from the motion: six where the body's own vertical leans by more than 60 degrees in more than a
// twentieth of the frames.
//
// The frame of alignment stands at the root's position, turned by
//
//   four: the heading about the vertical
//   six:  heading * reference * tilt * reference^-1      so that an upright posture is the same in both
//
// with heading, reference and tilt as codecs/stream/pose_vectors.h has them; all of it in the clip's own coarse frame.
// Curves are numbers per frame: x, y, z in cm, heading in radians, then for six the three parameters of the tilt.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/codecs/stream/pose_vectors.h"

namespace kinespace {

struct RootAlignment {
  int degrees = 4;  // 4 or 6
  int frames = 0;
  std::vector<double> curves;  // [curve][frame]

  // 4 or 7 curves.
  [[nodiscard]] static int curve_count(int degrees) { return degrees == 6 ? 7 : 4; }
  [[nodiscard]] std::span<const double> curve(int number) const {
    return {curves.data() + static_cast<std::size_t>(number) * static_cast<std::size_t>(frames),
            static_cast<std::size_t>(frames)};
  }
};

// A frame of reference: to it by turn^-1 (p - position).
struct RigidFrame {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// 4 or 6, from the motion.
[[nodiscard]] int alignment_degrees(const PoseVectors& vectors, const ReferencePose& reference);

[[nodiscard]] RootAlignment root_alignment(const PoseVectors& vectors, int degrees);

// Of one frame, from one number of each curve. The same bits on every machine.
[[nodiscard]] RigidFrame alignment_frame(std::span<const double> values, const ReferencePose& reference);

// The unit quaternion of modified Rodrigues parameters, 4 tan(angle / 4) times the axis. The same bits on every
// machine.
[[nodiscard]] Eigen::Quaterniond from_rodrigues(const Eigen::Vector3d& parameters);

}  // namespace kinespace
