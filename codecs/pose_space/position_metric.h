// How far a small change of a pose vector (codecs/stream/pose_vectors.h) moves the body: a quadratic form M with
//
//   dx' M dx  ~  sum over joints |dp|^2  +  shell_weight * sum over joints 1/3 sum_k |d(p + 3 cm R e_k)|^2     (cm^2)
//
// to first order about a pose. The second part sees what positions do not: turns of hands, toes and of limbs about
// their own axis (the shell error of motion/error_measures.h). Noise that is white where M is the identity is spread
// over the pose so that a bit buys as much joint position as anywhere: a step's weight is how far it moves the joints
// below.
#pragma once

#include <span>

#include <Eigen/Core>

#include "kinespace/codecs/stream/pose_vectors.h"
#include "kinespace/motion/skeleton.h"

namespace kinespace {

struct PoseMetric {
  Eigen::MatrixXd positions;
  Eigen::MatrixXd shell;

  // With a little of the identity, scaled to each diagonal, so that it has a Cholesky factor.
  [[nodiscard]] Eigen::MatrixXd combined(double shell_weight) const;
  // With four times its diagonal added, so that no direction is all but free: what is free at one pose is not at
  // others. Still scales every parameter by what it moves, which is all that joint_basis.h wants of it.
  [[nodiscard]] Eigen::MatrixXd lifted(double shell_weight) const;
};

// At one pose vector. Sums in a fixed order: the same bits on every machine.
[[nodiscard]] PoseMetric pose_metric(const Skeleton& skeleton, const ReferencePose& reference,
                                     std::span<const double> pose);

// The lower Cholesky factor, by plain loops in a fixed order: the same bits on every machine.
[[nodiscard]] Eigen::MatrixXd fixed_cholesky(const Eigen::MatrixXd& matrix);
// L^-T B, likewise.
[[nodiscard]] Eigen::MatrixXd solve_transposed(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& right);

// The second moments of the pose vectors of clips, over all frames.
[[nodiscard]] Eigen::MatrixXd pose_moments(std::span<const PoseVectors> vectors, int dimensions);
// The mean metric of 256 poses evenly over all clips; vectors[c] are those of clips[c].
[[nodiscard]] PoseMetric mean_pose_metric(std::span<const Clip> clips, std::span<const PoseVectors> vectors,
                                          const ReferencePose& reference);

}  // namespace kinespace
