// What a keyframe is compared by: the features whose Euclidean distance is the keyframe distance of yoo2019, eq. 12 and
// 13 (after lee 2010, "Motion fields").
//
//   d^2 = b_root |v - v'|^2 + b_0 |q_0(u) - q_0'(u)|^2
//         + sum_i b_i |p_i(u) - p_i'(u)|^2 + sum_i b_i |(q_i p_i)(u) - (q_i' p_i')(u)|^2
//
// p_i is a joint's local orientation, q_i its rotation from this keyframe to the next, so (q_i p_i)(u) = p_i of the
// next keyframe applied to u; v the root's step in metres to the next keyframe, in the clip's heading 0 frame; u a
// fixed unit vector; b_root = b_0 = 0.5, b_i the bone length in metres (the longest bone from the joint). Each term
// enters as a vector times the root of its weight. Keyframes are taken at `rate_hz`, so clips of different rates
// compare.
#pragma once

#include <vector>

#include "kinespace/motion/curves.h"

namespace kinespace {

struct PoseFeatures {
  int rows = 0;               // keyframes
  int dims = 0;               // 6 + 6 (J - 1): the root's 3 + 3, then 3 + 3 for each other joint
  std::vector<float> values;  // [keyframe][feature]
};

struct PoseFeatureOptions {
  double rate_hz = 30;       // keyframes per second
  double root_weight = 0.5;  // b_root
  double hip_weight = 0.5;   // b_0
};

// The features of any keyframes of a clip, as those of all of them are.
class PoseFeatureSource {
 public:
  // `curves` must outlive it.
  PoseFeatureSource(const ClipCurves& curves, const Skeleton& skeleton, const PoseFeatureOptions& options = {});
  PoseFeatureSource(ClipCurves&&, const Skeleton&, const PoseFeatureOptions& = {}) = delete;

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int dims() const { return 6 * static_cast<int>(weight_.size()); }
  // Keyframes [first, first + count), appended.
  void append(int first, int count, std::vector<float>& out) const;

 private:
  [[nodiscard]] SampleMatrix keyframes(int first, int count) const;
  void write(const SampleMatrix& keys, int first_key, int row, float* out) const;

  const ClipCurves& curves_;
  double step_;  // frames from one keyframe to the next
  int rows_;
  double root_weight_;
  std::vector<double> weight_;  // by joint
};

[[nodiscard]] PoseFeatures pose_features(const ClipCurves& curves, const Skeleton& skeleton,
                                         const PoseFeatureOptions& options = {});
[[nodiscard]] PoseFeatures pose_features(const Clip& clip, const PoseFeatureOptions& options = {});

}  // namespace kinespace
