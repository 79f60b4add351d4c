// Where the behaviour changes: segmentation by probabilistic principal components (Barbic, Safonova, Pan, Faloutsos,
// Hodgins, Pollard: "Segmenting Motion Capture Data into Distinct Behaviors", GI 2004; lin2011 section 4.1).
//
// The frames seen so far, K of them, are modelled as a Gaussian whose covariance keeps the q largest principal
// components (a share `variance` of all variance) and replaces the others by their mean, sigma^2. H(K) is the mean
// squared Mahalanobis distance of the next `window_s` of motion under that model. While the behaviour lasts H falls, or
// stays, as K grows by `step_s`; where another behaviour begins it rises: a rise of more than `rise` above the lowest
// value since the last cut, followed by a fall, is a cut at the peak, and the model starts again there. All this
// forward and backward in time; the cuts of both directions are united, and cuts closer than `apart_s` become one at
// their mean (forward in time a cut comes a little early, backward a little late).
//
// H is in units of its expected value, 1 for motion that the model explains; Barbic's rise of 15 stands for frames of
// some 60 numbers, hence the default.
#pragma once

#include <cstdint>
#include <vector>

#include "kinespace/repeats/frame_table.h"

namespace kinespace {

struct SegmentationOptions {
  double window_s = 1.25;  // 0.05 to 60: T, 150 frames at 120 Hz; also the first K
  double step_s = 0.1;     // 0.01 to 10: how much the model grows between two looks; Barbic: 10 frames at 120 Hz
  double variance = 0.95;  // 0.5 to 0.9999: share that the model's principal components keep
  double rise = 0.25;      // > 0: of H over its last valley
  double apart_s = 0.6;    // 0 to 60: cuts nearer than this are one
  int dimensions = 16;     // 2 to 64: the frames are first brought down to this many principal components of the table
  void validate() const;   // throws Error{usage} naming field, value and range
};

// The segments, in time: they cover all frames, and every start of the table begins one.
[[nodiscard]] std::vector<FrameSpan> behaviour_segments(const FrameTable& table,
                                                        const SegmentationOptions& options = {});

}  // namespace kinespace
