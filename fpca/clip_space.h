// One vector for a whole clip: what nearest-motion queries search.
//
// The whole clip, its time scaled to [0, 1], is sampled at 64 points: quaternions, and the root's velocity per clip
// length (so that the same motion played faster is the same curve), scaled such that over the library the velocity has
// `travel_share` of the variance of the rotations. Functional PCA of these curves gives the space; the vector is all
// scores, and the distance of two clips is the L2 distance of their curves (yoo2019, eq. 3), or with joint weights eq.
// 14:
//
//   D^2 = sum_c w_c^2 sum_k (x_kc - x'_kc)^2
#pragma once

#include <span>
#include <vector>

#include "kinespace/fpca/motion_space.h"
#include "kinespace/fpca/space_builder.h"

namespace kinespace {

struct ClipSpaceOptions {
  int functions = 16;         // 1 .. 64
  double travel_share = 0.2;  // [0, 10]; of the velocity's variance against the rotations'

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

class ClipSpace {
 public:
  // From all clips of a library, on the side of `references` (MotionSpace::references).
  [[nodiscard]] static ClipSpace build(const PreparedSource& clips, const Eigen::Matrix4Xd& references,
                                       const ClipSpaceOptions& options = {}, const Compute& compute = {},
                                       const Progress& progress = {});

  // The same with more clips: their moments merged in, functions found anew, the travel's scale kept.
  [[nodiscard]] ClipSpace extend(const PreparedSource& clips, const Compute& compute = {},
                                 const Progress& progress = {}) const;

  [[nodiscard]] const MotionSpace& space() const { return space_; }
  [[nodiscard]] double travel_scale() const { return travel_scale_; }
  [[nodiscard]] std::size_t dimensions() const {
    return static_cast<std::size_t>(space_.functions()) * static_cast<std::size_t>(space_.curves());
  }

  // [function][curve], for curves on any side.
  [[nodiscard]] std::vector<float> vector_of(const ClipCurves& curves, const Compute& compute = {}) const;
  // Those of several clips, projected together.
  [[nodiscard]] std::vector<std::vector<float>> vectors_of(std::span<const ClipCurves* const> clips,
                                                           const Compute& compute = {}) const;

  [[nodiscard]] Bytes pack() const;
  [[nodiscard]] static ClipSpace unpack(std::span<const std::byte> bytes, const std::string& source);

 private:
  ClipSpace(MotionSpace space, double travel_scale) : space_(std::move(space)), travel_scale_(travel_scale) {}
  MotionSpace space_;
  double travel_scale_;
};

// Weights of eq. 14, one a curve, mean square 1. Joints count by how far they move what hangs on them (curve_weights),
// the root's travel as much as an average joint: tang 2008 fitted weights to people's judgement for one skeleton; these
// need none.
[[nodiscard]] std::vector<float> distance_weights(const Skeleton& skeleton);

// Squared distance of two vectors of a space with `curves` curves; `weights` empty: plain.
[[nodiscard]] double squared_distance(std::span<const float> a, std::span<const float> b,
                                      std::span<const float> weights);

}  // namespace kinespace
