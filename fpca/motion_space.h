// The motion space (yoo2019, sections 4 and 5.3): orthonormal functions of one sequence's time, found by functional PCA
// over the curves of many sequences, and the vector of a sequence in it.
//
// A sequence is sampled at T points over [0, 1] of its (warped) time: C = 3 + 4 J curves, the root's velocity in m/s
// and the joints' quaternions. Curve c of group g is
//
//   f_c(s) = mu_g(s) + sum_k  x_kc phi_gk(s),      x_kc = integral (f_c - mu_g) phi_gk ds                 (eq. 1, 10)
//
// The vector of a sequence is all x_kc, function by function, most important first: its first n rows are the sequence
// at a coarser level of detail, and by Parseval the L2 error of leaving the rest out is the norm of the rest.
//
// Orthonormal functions are free at the ends of a sequence, and there the first few of them err most. In a pinned space
// the curves' values at both ends are kept as they are (a sequence shares them with its neighbours, so they cost one
// number a curve), and functions describe what is left above the straight line between them:
//
//   f_c(s) = (1 - s) f_c(0) + s f_c(1) + mu_g(s) + sum_k  x_kc phi_gk(s),      mu_g, phi_gk = 0 at both ends
//
// In a smoothed space (PACE: Yao, Mueller, Wang 2005) mean and covariance are smooth, the variance sigma^2 of white
// noise in the curves is taken off the covariance, and x_kc is what it is expected to be, given the noisy curve: with
// Phi = [phi_gk(s_i)] and Lambda the eigenvalues,
//
//   x_c = Lambda Phi' (Phi Lambda Phi' + sigma^2 I)^-1 (f_c - mu_g)
//
// A pinned space's vectors have the two ends as rows 0 and 1. Level of detail n takes n numbers a curve, in a pinned space an end and
// the first n - 1 functions; n times `pace` where sequences last so many times as long.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/fpca/curve_moments.h"
#include "kinespace/fpca/functional_pca.h"
#include "kinespace/kernels/device.h"
#include "kinespace/motion/curves.h"
#include "kinespace/motion/uniform_spline.h"

namespace kinespace {

// Which curves share functions (yoo2019, table 2).
enum class Grouping : std::uint8_t {
  all_together,         // one set of functions for all curves: the fewest functions over all, the default
  per_component,        // seven sets: velocity x y z, quaternion w x y z
  per_joint_component,  // a set for every curve: the lowest error for a count, by far the most functions
};

struct MotionSpaceOptions {
  Grouping grouping = Grouping::all_together;
  int points = 0;                    // T, 4 .. 1024; 0: those of the longest sequence and 12
  double variance_share = 0.999999;  // of the curves' variance that every sequence keeps, in (0, 1]; functions cover it
                                     // so that a tenth as much is left, for the sequences that need them ...
  std::optional<int> functions;      // ... or a count, 1 .. T
  bool smooth = false;               // smooth mean and covariance, expected scores (PACE); clean motion needs none
  bool pinned = false;               // the ends of sequences are kept apart
  int cycles = 0;                    // whole cycles that a sequence holds, 0 .. 8; 0: it was cut at rests
  double pace = 1;                   // numbers a curve that one more level of detail takes, 1 .. 100

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

class MotionSpace;
// library/detail/space_codec.h
[[nodiscard]] Bytes pack_space(const MotionSpace& space);
[[nodiscard]] MotionSpace unpack_space(std::span<const std::byte> bytes, const std::string& source);

// [function][curve]: row k holds x_kc, behind the two ends where the space is pinned. Groups with fewer functions have
// zeros in the rows they lack.
using ScoreMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The functions of one group of curves.
struct FunctionGroup {
  Eigen::VectorXd mean;         // T
  Eigen::MatrixXd functions;    // T x K, orthonormal under the trapezoid rule
  Eigen::VectorXd eigenvalues;  // K, descending
  double variance = 0;          // of the curves about their common mean
  double left = 0;              // of it, what ends and functions do not reach
  // Of a smoothed space: sigma^2, and what turns curves less the mean into expected scores, K x T.
  std::optional<double> noise;
  Eigen::MatrixXd conditional;

  // Scores are conditional expectations from now on; `noise_variance` >= 0. The functions must be there.
  void expect_scores(double noise_variance);
};

class MotionSpace {
 public:
  // No functions yet; see fit. `references`: 4 x J, the quaternion that each joint's curves lie on the side of.
  MotionSpace(Skeleton skeleton, MotionSpaceOptions options, int points);

  // Which sign each joint's quaternions get, over the whole library: the side of its mean orientation (the main axis of
  // sum q q', markley 2007, which knows no signs).
  void set_references(const Eigen::Matrix4Xd& references);
  [[nodiscard]] const Eigen::Matrix4Xd& references() const { return references_; }
  // Turns the quaternion curves of a clip to that side: the root by its first frame, other joints by their sum.
  void apply_references(SampleMatrix& values) const;
  // What it multiplies each curve by: 1 or -1.
  [[nodiscard]] Eigen::RowVectorXd reference_signs(const SampleMatrix& values) const;

  // One accumulator for each group, to be filled by accumulate.
  [[nodiscard]] std::vector<CurveMoments> empty_moments() const;
  // Adds the curves of sequences: `samples` are T x C blocks. An OpenCL device works in float: 1e-6 of the largest
  // entry.
  void accumulate(std::span<const SampleMatrix> samples, std::vector<CurveMoments>& moments,
                  const Compute& compute = {}) const;
  // Finds the functions; none where there are no curves. The moments stay with the space, so that it can be extended.
  void fit(std::vector<CurveMoments> moments, const Compute& compute = {});

  // T x C samples to scores (rows() x C) and back, at level of detail n (all when n < 0 or too large). Scores of a
  // smoothed space are expected ones: `samples` of them are the curves less their noise.
  [[nodiscard]] ScoreMatrix scores(const SampleMatrix& samples, const Compute& compute = {}) const;
  // The same for many sequences: on an OpenCL device one product for each group of curves, in float.
  [[nodiscard]] std::vector<ScoreMatrix> scores(std::span<const SampleMatrix> samples,
                                                const Compute& compute = {}) const;
  [[nodiscard]] SampleMatrix samples(const ScoreMatrix& scores, int n = -1) const;
  // Sets to 0 the last functions' scores of a sequence, as many as together hold no more than half of (1 -
  // variance_share) of the variance; none where a count of functions was asked for, and in a smoothed space.
  void drop_needless(ScoreMatrix& scores) const;
  // Scores in this space of what the scores were in another one of the same grid and curves (after it was extended).
  [[nodiscard]] ScoreMatrix transfer(const ScoreMatrix& scores, const MotionSpace& from) const;

  // Root mean square over the sequence's time of the error in each curve at level of detail n >= 1.
  [[nodiscard]] Eigen::VectorXd truncation_error(const ScoreMatrix& scores, int n) const;

  [[nodiscard]] const Skeleton& skeleton() const { return skeleton_; }
  [[nodiscard]] const CurveLayout& layout() const { return layout_; }
  [[nodiscard]] const MotionSpaceOptions& options() const { return options_; }
  [[nodiscard]] int points() const { return points_; }
  [[nodiscard]] int curves() const { return layout_.curve_count(); }
  [[nodiscard]] int functions() const;       // of the largest group
  [[nodiscard]] int rows() const;            // of a score matrix: functions, and two ends where the space is pinned
  [[nodiscard]] int levels() const;          // the level of detail that has all rows
  [[nodiscard]] int rows_at(int n) const;    // of level of detail n, the ends at least; all when n < 0
  [[nodiscard]] int function_count() const;  // over all groups
  [[nodiscard]] int group_of(int curve) const;
  [[nodiscard]] int group_count() const;
  [[nodiscard]] const std::vector<FunctionGroup>& groups() const { return groups_; }
  [[nodiscard]] const std::vector<CurveMoments>& moments() const { return moments_; }
  // Share of all variance that ends and functions cover; nearly all variance is where curves stand, not how they move.
  [[nodiscard]] double variance_covered() const;
  // The same of the variance of each curve about its own mean in time.
  [[nodiscard]] double movement_covered() const;

 private:
  [[nodiscard]] std::vector<int> curves_of_group(int group) const;
  [[nodiscard]] FunctionGroup fit_pinned(const CurveMoments& moments) const;
  [[nodiscard]] ScoreMatrix scores_by(ScoreKind kind, const SampleMatrix& samples) const;
  [[nodiscard]] std::vector<ScoreMatrix> scores_on_device(std::span<const SampleMatrix> samples,
                                                          const Compute& compute) const;
  void add_ends(const ScoreMatrix& scores, SampleMatrix& samples) const;

  friend Bytes pack_space(const MotionSpace& space);
  friend MotionSpace unpack_space(std::span<const std::byte> bytes, const std::string& source);

  Skeleton skeleton_;
  CurveLayout layout_;
  MotionSpaceOptions options_;
  int points_;
  Eigen::VectorXd weights_;  // trapezoid rule over [0, 1]
  Eigen::Matrix4Xd references_;
  std::vector<FunctionGroup> groups_;
  std::vector<CurveMoments> moments_;
};

}  // namespace kinespace
