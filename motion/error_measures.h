// How far one clip is from another: the measures every codec and every level of detail is judged by.
#pragma once

#include "kinespace/motion/clip.h"

namespace kinespace {

// How far from a joint, along its axes, the points stand by which the shell error sees turns.
inline constexpr double shell_cm = 3;

// `a` is the reference. Joints are matched by name; only joints that both have count, end sites never do.
struct MotionError {
  int joints = 0;
  int frames = 0;
  double mean_joint_error_cm = 0;  // Euclidean distance of world joint positions, mean over joints and frames
  double max_joint_error_cm = 0;
  double shell_error_cm =
      0;  // points 3 cm from each joint along its three axes: largest of the three, mean over joints and frames
  double mean_rotation_error_deg = 0;  // angle between world rotations, mean over joints and frames
  double kg = 0;                // 100 ||A - B||_F / ||A - E(A)||_F, percent; E(A): centroid of each frame (karni 2004)
  double kg_time = 0;           // the same with E(A): mean over time of each joint (yoo2019, eq. 16)
  double channel_mse_deg2 = 0;  // mean squared difference of local Euler channels in degrees squared, unwrapped
};

// Throws Error{bad_input} when the frame counts differ or no joint is common.
[[nodiscard]] MotionError compare(const Clip& a, const Clip& b);

}  // namespace kinespace
