// One gap at the model's rate: the estimate, what spreads it, and how the library's own gaps calibrate that. Private to
// this folder.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/detail/filling_estimate.h"
#include "kinespace/synthesis/detail/filling_library.h"
#include "kinespace/synthesis/filling.h"

namespace kinespace {

// Sources of variance of joint positions, cm^2 on one axis (the mean of three): [i][joint] for row rows[i] of the gap.
struct GapSpread {
  static constexpr int sources = 3;
  std::vector<int> rows;  // every 0.1 s, and the last
  // The scores that what is seen leaves open; the process beyond the windows; how far the two estimates are apart.
  std::array<Eigen::MatrixXd, sources> variance;
};

struct GapEstimate {
  SampleMatrix mean;  // [row of the gap][curve], features
  GapSpread spread;
  int windows = 0;
};

// `query`: a track of shape.frames() frames. `search.count` is not looked at. Fewer than 2 windows: no mean.
[[nodiscard]] GapEstimate estimate_gap(const FillLibrary& library, const FillOptions& options, const FillTrack& query,
                                       const WindowShape& shape, FillLibrary::Search search);

// World frames (ground position and heading of the features) of all joints for one row of features; `out` is resized.
// Joints above the travel root stand at the travel root.
void feature_frames(const FillLibrary& library, const Eigen::RowVectorXd& features, std::vector<JointFrame>& out);

// How the sources add up to a variance, by the gap's length, and how often a standard deviation is not exceeded.
struct FillCalibration {
  struct Length {
    double gap_s = 0;
    std::array<double, GapSpread::sources> shares = {1, 1, 1};
  };
  std::vector<Length> lengths;    // ascending; at least one
  std::vector<double> quantiles;  // [i]: not exceeded by a share (i + 1) / 100 of |error| / std; empty: normal

  // Standard deviation [i][joint] in cm, rows as those of the spread.
  [[nodiscard]] Eigen::MatrixXd std_cm(const GapSpread& spread, double gap_s) const;
};

// Deterministic: which gaps are filled depends on the library alone.
[[nodiscard]] FillCalibration calibrate(const FillLibrary& library, const FillOptions& options,
                                        const Progress& progress);

}  // namespace kinespace
