// What a keyframe is compared by: the features whose Euclidean distance is the keyframe distance of yoo2019, eq. 12 and
// 13 (after lee 2010, "Motion fields").
//
//   d^2 = b_root |v - v'|^2 + b_0 |q_0(u) - q_0'(u)|^2 + sum_i b_i |p_i(u) - p_i'(u)|^2 + sum_i b_i |(q_i p_i)(u) -
//   (q_i' p_i')(u)|^2
//
// p_i is a joint's local orientation, q_i its rotation from this keyframe to the next, so (q_i p_i)(u) = p_i of the
// next keyframe applied to u; v the root's step in metres to the next keyframe, in the clip's heading 0 frame; u a
// fixed unit vector; b_root = b_0 = 0.5, b_i the bone length in metres (the longest bone from the joint). Each term
// enters as a vector times the root of its weight. Keyframes are taken at `rate_hz`, so clips of different rates
// compare.
#pragma once

#include <vector>

#include "fpca/curves.h"

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

[[nodiscard]] PoseFeatures pose_features(const ClipCurves& curves, const Skeleton& skeleton,
                                         const PoseFeatureOptions& options = {});
[[nodiscard]] PoseFeatures pose_features(const Clip& clip, const PoseFeatureOptions& options = {});

}  // namespace kinespace
