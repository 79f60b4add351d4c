// Puts legs where they shall be: the root moved, the ankles at targets, the feet turned. The last step of cleanup.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/footskate/feet.h"

namespace kinespace {

// What shall change, one entry a frame.
struct LegGoals {
  struct Side {
    std::vector<Eigen::Vector3d> ankle;      // cm, world: where it shall be
    std::vector<Eigen::Vector3d> foot_turn;  // rotation vector, world: by how much the foot turns from how it stood
  };
  std::vector<Eigen::Vector3d> root_shift;  // cm, world
  std::array<Side, 2> sides;
  double give_cm = 0.0015;  // of the ankles of nearly straight legs, so that knees stay smooth (knee_bends.h)
};

// Meets these goals by two-bone inverse kinematics (footskate/two_bone_ik.h). A foot keeps its orientation in the world
// but for its turn; every other joint keeps its local rotation. What is where it shall be, to 1e-7 cm, keeps its
// numbers.
void pose_legs(Clip& clip, const Feet& feet, const LegGoals& goals);

// The tracks of a clip that pose_legs writes to, as they were: of a skeleton of 22 joints less than a third of the
// clip.
class LegTracks {
 public:
  LegTracks(const Clip& clip, const Feet& feet);

  void put_back(Clip& clip) const;
  // Some frames of the clip as they were; `now` is the whole clip as it is.
  [[nodiscard]] Clip slice_before(const Clip& now, int first, int count) const;

 private:
  // From frame `first` on, as many frames as `clip` has.
  void write(Clip& clip, int first) const;

  std::array<int, 6> joints_;
  int root_joint_;
  std::array<std::vector<double>, 6> rotations_;
  std::vector<Eigen::Vector3d> root_;  // empty: there was no track
};

// The axis about which the knee of a leg bends in this clip, in the frame of its hip joint: the mean over the frames,
// weighted by the bend; zero when the leg never bends.
[[nodiscard]] Eigen::Vector3d mean_knee_axis(const Clip& clip, const Leg& leg);

}  // namespace kinespace
