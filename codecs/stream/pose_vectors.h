// A clip as curves that a linear codec can take apart, and back: one vector of numbers a frame,
//
//   0 1 2       position of the travel root in cm
//   3           heading in radians: the root's turn about the vertical, unwrapped, smooth where the root hangs upside
//               down
//   4 + 3 j ..  the turn of rotating joint j from its reference orientation, as 4 tan(angle / 4) times the axis
//               (modified Rodrigues parameters: a rotation vector near zero, and back to a quaternion without sine,
//               cosine or root); the root's without its heading
//
// in the clip's own frame: turned about the vertical and moved by a coarse Placement (steps of 1/128 turn, 8 cm), so
// that clips that walk off in different directions look alike. What the vectors do not carry (joints above the travel
// root, translations of other joints) goes beside them as side tracks (motion/curves.h).
//
// The parameters of a joint run to infinity at a full turn from its reference. Long before that, beyond 210 degrees,
// the other quaternion of the same rotation takes over: its curves jump there, at a frame that is named in `jumps`, and
// a codec must not look for smoothness across it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

// The reference orientations of the rotating joints, on a grid of 1/127 in x, y, z, so that three bytes a joint tell
// them.
struct ReferencePose {
  std::vector<std::array<std::int8_t, 3>> steps;  // w is what makes it a unit quaternion, >= 0

  [[nodiscard]] int joint_count() const { return static_cast<int>(steps.size()); }
  [[nodiscard]] int dimensions() const { return 4 + 3 * joint_count(); }
  [[nodiscard]] Eigen::Quaterniond orientation(int joint) const;
};

struct CoarsePlacement {
  static constexpr double cm_per_step = 8;
  static constexpr int steps_per_turn = 128;

  std::array<std::int32_t, 3> position{};  // cm_per_step each
  std::int32_t heading = 0;                // steps_per_turn to the turn

  [[nodiscard]] Eigen::Vector3d start_cm() const;
  [[nodiscard]] Eigen::Quaterniond turn() const;
};

struct PoseVectors {
  int frames = 0;
  CoarsePlacement placement;
  std::vector<double> values;  // [dimension][frame]
  std::vector<int> jumps;      // frames, ascending, that do not go on smoothly from the one before
  std::vector<SideTrack> side_tracks;

  [[nodiscard]] std::span<const double> curve(int dimension) const {
    return {values.data() + static_cast<std::size_t>(dimension) * static_cast<std::size_t>(frames),
            static_cast<std::size_t>(frames)};
  }
};

// The reference pose of clips of one tree: for each joint the mean of the orientations that they show (the eigenvector
// of the largest eigenvalue of sum q q').
[[nodiscard]] ReferencePose reference_pose(std::span<const Clip> clips);

// A joint at a time: beside the vectors no more than a few numbers a frame are held. Throws Error{bad_input} naming the
// clip when a value is not finite or a position lies farther than 1e7 cm away.
[[nodiscard]] PoseVectors pose_vectors(const Clip& clip, const ReferencePose& reference);

// Writes frames [first, first + count) of a clip from the vectors of these frames, [dimension][count]: local rotations
// and the travel of the root. Side tracks must have been applied to the clip before. Same bits on every machine.
class PoseWriter {
 public:
  PoseWriter(const ReferencePose& reference, const CoarsePlacement& placement, Clip& clip);
  void write(std::span<const double> vectors, int first, int count);

 private:
  void write_root(std::span<const double> vectors, int first, int count);

  std::vector<Eigen::Quaterniond> reference_;
  Eigen::Vector3d start_;
  Eigen::Quaterniond turn_;
  Clip& clip_;
  std::vector<int> joints_;
  std::vector<int> above_;  // the joints above the travel root, from joint 0 down
};

// The vectors of a clip as they lie: [dimension][frame].
using PoseCurves = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
[[nodiscard]] inline PoseCurves pose_curves(const PoseVectors& vectors, int dimensions) {
  return {vectors.values.data(), dimensions, vectors.frames};
}

}  // namespace kinespace
