// The frames that a repeated clip refers to, from a path of the self-distance table at its lower rate. Private to this
// folder.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace kinespace {

struct WarpOptions {
  std::int64_t reach = 1;  // frames that a reference may stand off the path
  float jump = 0;          // squared distance that a step other than one frame costs, for each frame it is off
};

// Of each column of `repeated` ([axis][frame]) a column of `primary`: a path near `guess` (never falling, inside the
// primary clip) with the least sum of squared distances and jumps, by dynamic programming over steps of 0 to 4 frames.
// The guess itself where no such path is in reach. Never falling.
[[nodiscard]] std::vector<std::int64_t> warp_references(const Eigen::MatrixXf& repeated, const Eigen::MatrixXf& primary,
                                                        std::vector<std::int64_t> guess, const WarpOptions& options);

}  // namespace kinespace
