// Interpolation of motions (yoo2019, section 6.1): blends of any number of motion vectors, and Bezier curves through
// them.
//
// A motion is linear in its vector, so a blend of vectors, sum_i a_i x_i with sum_i a_i = 1, is the same blend of the
// curves at corresponding times. Times correspond as time_alignment.h finds; a blend lasts the blend of the durations,
// its root's velocity is the blend of the velocities, its quaternions are renormalised. Weights that are 1 for one
// motion give that motion back, frame for frame.
//
// A Bezier curve passes through x_0, x_1, .., x_n at t = 0, 1, .., n. Its inner control points are near neighbours:
// each ideal one (Catmull-Rom, a third of the way) gives way to a real motion of the library among the k nearest of its
// end, if one lies within a third of the way of it, so that the curve stays among motions that people make. The control
// points on both sides of an x_i mirror each other, so that the curve has no corner there.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/seam.h"

namespace kinespace {

// A cubic Bezier curve whose points are weights of motions.
class BezierWeights {
 public:
  // `controls`: 3 n + 1 rows, P0 P1 P2 P3=P0' P1' ..; each row sums to 1.
  explicit BezierWeights(Eigen::MatrixXd controls);
  // Through the first `through` of `vectors` (one row a motion), with inner control points among the others.
  static BezierWeights through_motions(const Eigen::MatrixXd& vectors, int through);

  // Weights at t in [0, segments()], clamped; at a whole number exactly 1 for that motion and 0 for the others.
  [[nodiscard]] Eigen::VectorXd at(double t) const;
  [[nodiscard]] int segments() const { return static_cast<int>(controls_.rows() - 1) / 3; }
  [[nodiscard]] const Eigen::MatrixXd& controls() const { return controls_; }

 private:
  Eigen::MatrixXd controls_;
};

// The weights at a share of the blend's time, from 0 to 1: one number a motion, sum 1.
using WeightCurve = std::function<Eigen::VectorXd(double)>;

struct BlendedMotion {
  Clip clip;  // named after the motions; at the first motion's rate, its start between theirs
  SeamRatios ratios;
};
// The blend of motions of one tree, on `skeleton`; their curves on the space's side.
[[nodiscard]] BlendedMotion blend_motions(std::span<const ClipCurves> motions, const Skeleton& skeleton,
                                          const WeightCurve& weights);

struct BlendOptions {
  std::optional<std::vector<double>> weights;  // one a clip, any sum but 0: a plain blend
  std::optional<double> at;                    // else the point of the Bezier curve, [0, clips - 1]
  // With neither, the blend goes along the curve from the first clip to the last while it plays.
  int neighbours = 10;  // k, >= 0; 0: control points are ideal ones
  int functions = -1;   // level of detail of the motions; -1: all

  // Throws Error{usage} naming field, value and legal range.
  void validate(std::size_t clips) const;
};

struct Blend {
  Clip clip;
  std::vector<std::string> controls;  // library clips that serve as control points
  double scale = 1;                   // duration over that of the first clip
  double cost_cm = 0;                 // how far neighbouring motions are apart at corresponding times, the most
  SeamRatios ratios;                  // over the whole blend
};

// The mean distance of the joints in cm at corresponding times, both seen from the hips with one heading at the start.
[[nodiscard]] double motion_distance_cm(const ClipCurves& a, const ClipCurves& b, const Skeleton& skeleton);

// Of clips of one library. Throws Error{usage} for an unknown clip and Error{bad_input} for clips of different
// skeletons.
[[nodiscard]] Blend make_blend(LibraryView& library, std::span<const std::string> clips,
                               const BlendOptions& options = {});

}  // namespace kinespace
