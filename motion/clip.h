// A clip: the motion of one skeleton, sampled at a fixed rate. A plain movable value.
//
// Units: centimetres, radians, seconds, Y up, right-handed, unit quaternions (w, x, y, z). Each joint's rotations are
// contiguous in time, so that a joint's curve is one span.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/motion/skeleton.h"

namespace kinespace {

struct Clip {
  // A joint's translation in its parent's frame, where it is not the constant rest offset.
  struct TranslationTrack {
    int joint = 0;
    std::vector<Eigen::Vector3d> values;  // cm, one a frame
  };

  std::string name;  // as the user knows it: the file name without its ending
  Skeleton skeleton;
  double rate_hz = 0;                          // frames per second, > 0
  int frames = 0;                              // >= 1
  std::vector<double> rotations;               // [joint][frame][w x y z]; identity for joints without rotation channels
  std::vector<TranslationTrack> translations;  // by joint, ascending; only joints that move in this clip

  [[nodiscard]] double duration_s() const { return (frames - 1) / rate_hz; }

  // [frame][w x y z] of one joint: 4 * frames numbers.
  [[nodiscard]] std::span<double> rotation_track(int joint);
  [[nodiscard]] std::span<const double> rotation_track(int joint) const;
  [[nodiscard]] Eigen::Quaterniond rotation(int joint, int frame) const;
  void set_rotation(int joint, int frame, const Eigen::Quaterniond& q);

  // nullptr when the joint keeps its rest offset.
  [[nodiscard]] const TranslationTrack* translation_track(int joint) const;
  [[nodiscard]] TranslationTrack* translation_track(int joint);
  // The joint's translation in its parent's frame at a frame: the track, else the rest offset.
  [[nodiscard]] Eigen::Vector3d translation(int joint, int frame) const;
  // The track of a joint, made (filled with the rest offset) when it is missing.
  TranslationTrack& require_translation_track(int joint);
};

// A clip of that many frames at rest: identity rotations, no tracks.
[[nodiscard]] Clip make_clip(std::string name, Skeleton skeleton, double rate_hz, int frames);

// Frames [first, first + count) as a clip of its own.
[[nodiscard]] Clip slice(const Clip& clip, int first, int count);

}  // namespace kinespace
