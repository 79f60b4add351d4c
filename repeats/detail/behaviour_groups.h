// What a grouping of segments is expected to cost, and how it is made cheaper. Private to this folder.
//
//   cost = sum over groups: axes * (seconds * coefficient_rate + dimensions * axis_weight)
//
// in coefficients; a group's axes are the fewest that leave at most `residual` of the variance of a frame.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/repeats/detail/frame_moments.h"
#include "kinespace/repeats/grouping.h"

namespace kinespace {

class BehaviourGroups {
 public:
  // `moments` of each segment outlive this; `dimensions` are those of the frames before they were reduced.
  BehaviourGroups(std::span<const FrameMoments> moments, int dimensions, double rate_hz, double residual,
                  const GroupingOptions& options)
      : moments_(moments), dimensions_(dimensions), rate_hz_(rate_hz), residual_(residual), options_(options) {}

  [[nodiscard]] double cost(const std::vector<int>& group) const;
  // Segments move to the group whose space leaves the least of them, as long as that makes the grouping cheaper.
  void refine(std::vector<int>& group) const;

 private:
  struct Space {
    std::int64_t frames = 0;
    Eigen::VectorXd mean;
    Eigen::MatrixXd outside;  // I - axes axes'
    int axes = 0;
  };
  [[nodiscard]] std::vector<Space> spaces(const std::vector<int>& group) const;
  [[nodiscard]] double cost(std::span<const Space> spaces) const;

  std::span<const FrameMoments> moments_;
  int dimensions_;
  double rate_hz_;
  double residual_;
  const GroupingOptions& options_;
};

}  // namespace kinespace
