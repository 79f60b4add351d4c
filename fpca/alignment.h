// Time alignment of sequences (yoo2019, section 5.2): for each a warp under which the first few functions of the space
// leave least of it.
//
// A warp is proposed by dynamic time warping (keyframe distance, slopes in [1/2, 2]) to the template of the sequence's
// group, and both that proposal and the identity are refined by descent on the warp's coefficients. What is minimised
// is what the paper aligns for, the part of the curves that the first n functions do not reach,
//
//   E_n(h) = integral sum_c w_c^2 |(I - P_n)(f_c(h(s)) - mu(s))|^2 ds,      P_n: projection on the first n functions,
//
// with weights that turn curves into how far they move the joints: for a quaternion twice the root mean square over all
// joints of their distance below it (0 for those that are not), for the velocity 0.1 s. It is minimised at two levels
// of detail at once: the product E_n E_2n, so that neither is bought with the other. The identity stays unless the best
// warp takes at least `least_gain` of the geometric mean of the two.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/fpca/encoding.h"
#include "kinespace/fpca/motion_space.h"
#include "kinespace/fpca/warp.h"
#include "kinespace/kernels/dtw.h"

namespace kinespace {

struct AlignmentOptions {
  int functions = 5;         // n, 1 .. 64; aligned for this level of detail and for twice as many
  int rounds = 2;            // 0 .. 10; each aligns to the functions of the round before
  double least_gain = 0.15;  // [0, 1); share of sqrt(E_n E_2n) that a warp must take to be kept
  bool on_trial = true;      // for all of a library only where warps win on clips that they were not found with
  int templates = 48;        // 0 .. 1000; groups, each with a template; 0: refine from the identity only

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// Searches warps against the functions of one space (all curves together).
class WarpSearch {
 public:
  WarpSearch(const MotionSpace& space, const AlignmentOptions& options);

  // The best warp of the sequence [first, last] of a run, from the identity and the proposals.
  [[nodiscard]] Warp best(const RunSampler& run, int first, int last, std::span<const Warp> proposals) const;
  // sqrt(E_n E_2n) of a warp.
  [[nodiscard]] double residual(const RunSampler& run, int first, int last, const Warp& warp) const;

 private:
  using Row = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Scratch {
    Row own;         // the sequence over its own time, finely
    Row ends;        // 2 x C: what the line between the ends is drawn through; zeros where the space is not pinned
    Row projection;  // n x C
    Eigen::RowVectorXf row;
  };
  [[nodiscard]] Scratch prepare(const RunSampler& run, int first, int last) const;
  [[nodiscard]] double residual(Scratch& scratch, const Warp& warp) const;
  [[nodiscard]] std::pair<double, Warp> descend(Scratch& scratch, Warp warp) const;

  AlignmentOptions options_;
  int curves_;
  bool pinned_;
  Eigen::VectorXf mean_;     // at the search's points, times the root of their weight
  Eigen::Index coarse_ = 0;  // n
  Row functions_;            // [point][function], 2n of them, orthonormal columns under the plain dot product
  Eigen::VectorXf root_weight_;
  Eigen::RowVectorXf curve_weight_;  // w_c
};

// w_c of the curves of a skeleton, in metres per unit of the curve.
[[nodiscard]] Eigen::RowVectorXd curve_weights(const Skeleton& skeleton);

// Groups of similar sequences: `count` templates spread over all of them (farthest first, from the one nearest to the
// mean; no random choice), and for each sequence the template nearest to it.
struct TemplateGroups {
  std::vector<int> templates;  // indices of sequences
  std::vector<int> group;      // for each sequence an index into templates
};
// `vectors`: one row a sequence.
[[nodiscard]] TemplateGroups group_sequences(const Eigen::MatrixXf& vectors, int count);

// The warp that follows a matching of frames (template frame, own frame), both ends matched.
[[nodiscard]] Warp warp_of_path(std::span<const FramePair> path, int template_frames, int own_frames);

}  // namespace kinespace
