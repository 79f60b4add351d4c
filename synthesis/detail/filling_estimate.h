// Conditional expectation of the unseen rows of a window from the seen ones (the formulas of synthesis/filling.h).
// Private to this folder.
#pragma once

#include <span>
#include <vector>

#include "kinespace/synthesis/detail/filling_library.h"

namespace kinespace {

// A Gaussian prior over windows: windows of the library with weights, and the process for what they leave open.
struct WindowPrior {
  int windows = 20;       // of the nearest
  double scale_m = 0.3;   // standard deviation of the process
  double length_s = 0.8;  // of its Matern 3/2 covariance
  double noise = 0.02;    // white part, of scale_m
};

struct WindowEstimate {
  SampleMatrix mean;                   // [row of the gap][curve]
  std::vector<Eigen::MatrixXf> modes;  // for each row asked for [curve][mode]: a standard deviation along an
                                       // independent direction
  Eigen::VectorXd open_variance;       // for each row asked for: of the process, the same for every curve
};

// `members`: windows of the library as features, one a row ([row][curve] flattened), nearest first, with their squared
// distances; `seen`: the window to fill, any values in its gap; `spread_rows`: rows of the gap whose variance is
// wanted.
[[nodiscard]] WindowEstimate estimate_window(const FeatureMatrix& members, std::span<const double> distances,
                                             const SampleMatrix& seen, const WindowShape& shape,
                                             const WindowPrior& prior, std::span<const int> spread_rows);

}  // namespace kinespace
