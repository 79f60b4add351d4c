// Windows of clips as vectors: what is compared when a stretch of motion is looked for inside long clips.
//
// A window is the motion over `length_s`, sampled at `rate_hz`: the root's velocity and the joints' quaternions, turned
// about the vertical so that the window's first sample has heading 0, each joint's quaternions on the side of its mean
// orientation. Functional PCA over windows gives `functions` orthonormal functions of a window's time (the curves of
// all joints share them, as in yoo2019, eq. 1 and 10); the scores x_kc, scaled by curve, are turned onto their own
// principal components, of which the `dimensions` leading ones are the vector. Both steps keep distances but for what
// they leave out, so the distance of two vectors is that of the two windows' curves:
//
//   D^2 = mean over the window's time of sum_c w_c^2 (f_c - f'_c)^2
//
// w_c is 1 for quaternions (with joint weights eq. 14: distance_weights) and, for the velocity in m/s, such that it has
// `travel_share` of the rotations' variance over all windows.
//
// Windows start at every sample. The scores are linear in the curves, and so is the turn to heading 0, so a clip's
// windows are one pass over its samples.
#pragma once

#include <span>
#include <vector>

#include "kinespace/kernels/matrix.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

struct WindowOptions {
  double length_s = 1.0;      // 0.1 .. 20; of a window
  double rate_hz = 30;        // 1 .. 240; samples per second, and so windows per second; length_s * rate_hz >= 3
  int functions = 12;         // 1 .. 64; of a window's time, at most its samples
  int dimensions = 256;       // 1 .. 4096; of a vector, at most functions times curves
  double travel_share = 0.2;  // [0, 10]; of the velocity's variance against the rotations'
  bool weighted = false;      // joint weights (eq. 14)

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
  // Samples of a window, both ends included. Its length is (samples() - 1) / rate_hz: length_s to half a sample.
  [[nodiscard]] int samples() const;
};

// A stretch of one clip, sampled for windows: [sample][curve], velocity in m/s, quaternions as the clip has them.
using WindowSamples = RowMatrix<float>;

// Samples from `start_s` on, as far as frame `last` of the clip reaches. The curves are interpolated over the frames
// `first` .. `last` (a stretch without breaks). No rows when start_s is beyond.
[[nodiscard]] WindowSamples window_samples(const ClipCurves& curves, int first, int last, double start_s,
                                           const WindowOptions& options);

class WindowSpace {
 public:
  // From the windows of all stretches; of many, evenly spread ones are looked at. `references`: 4 x J
  // (MotionSpace::references). Throws Error{usage} when no stretch is as long as a window.
  [[nodiscard]] static WindowSpace fit(std::span<const WindowSamples> stretches, const Skeleton& skeleton,
                                       const Eigen::Matrix4Xd& references, const WindowOptions& options = {});

  [[nodiscard]] const WindowOptions& options() const { return options_; }
  [[nodiscard]] int curves() const { return static_cast<int>(scale_.size()); }
  [[nodiscard]] int dimensions() const { return static_cast<int>(components_.cols()); }

  // One row for each window of the stretch: row i starts at sample i.
  [[nodiscard]] RowMatrix<float> vectors(const WindowSamples& stretch) const;
  // How many windows a stretch of so many samples has.
  [[nodiscard]] int windows(Eigen::Index samples) const;

 private:
  WindowSpace(WindowOptions options, Eigen::Matrix4Xf references);
  void fit_functions(std::span<const WindowSamples> stretches, const Skeleton& skeleton, int every);
  void fit_components(std::span<const WindowSamples> stretches, int every);
  // Scores of the windows 0, every, 2 every, ... of a stretch, before the turn onto components: [window][k * C + c].
  [[nodiscard]] RowMatrix<float> scores(const WindowSamples& stretch, int first, int every, int count) const;

  WindowOptions options_;
  Eigen::Matrix4Xf references_;
  RowMatrix<float> projector_;    // (1 + K) x samples: the plain mean over the window, then the functions
  Eigen::RowVectorXf scale_;      // w_c
  Eigen::VectorXd mean_;          // K * C
  RowMatrix<double> components_;  // (K * C) x dimensions
};

}  // namespace kinespace
