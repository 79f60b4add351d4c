// Missing frames, estimated from what is seen on both sides and from a library of motions, with how sure that is.
//
// Method. At 30 Hz a window is the gap with `context_s` on either side: all curves (motion/curves.h) as one vector-valued
// function, its heading and ground position taken from the frame before the gap. The library's windows whose seen part
// is nearest (poses and their change over 0.1 s, frames at the gap first) are weighted by a Gauss kernel and give a
// mean mu and principal components Phi, found by their Gram matrix: far fewer windows than dimensions. What these leave
// open, r, is a Gaussian process in time (Matern 3/2, length 0.8 s) that hits what is seen at the edges, so that
// nothing jumps, in place or in speed. With y = mu + Phi z + r, z normal, and V = cov(r) over the seen frames o,
//
//   z   = (I + Phi_o' V^-1 Phi_o)^-1 Phi_o' V^-1 (y_o - mu_o)                    (conditional expectation)
//   y_u = mu_u + Phi_u z + cov(r_u, r_o) V^-1 (y_o - mu_o - Phi_o z)             (the missing frames u)
//
// both times over, with few windows that lie near and with many; the mean of the two is taken. (One space for all
// windows, as yoo2019 builds it, had more than twice this error in a prototype.) Between the 30 Hz knots a cubic spline
// gives the clip's own rate. The constants were chosen by the errors of gaps in cmu 01-03 and bandai2, over seven folds
// of clips of which `bench filling` shows one.
//
// Uncertainty: the posterior covariance carried to joint positions, and the difference of the two estimates; their
// shares are fitted on gaps cut into the library itself, each filled without the clip it was cut from. What a standard
// deviation says: on each axis a joint's error is within +- interval(p) standard deviations with probability p.
//
// What is not estimated: joints above the travel root and translations of other joints (interpolated), contacts (see
// footskate/). A gap at the start or the end of a clip has one side only and is an error.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/progress.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/clip.h"
#include "kinespace/synthesis/filling_gap.h"

namespace kinespace {

struct FillOptions {
  double context_s = 0.13;    // 0.05 to 2: seen on either side; less where the clip begins, ends or has another gap
  int near_windows = 30;      // 4 to 200: of the estimate from few windows
  int far_windows = 300;      // near_windows to 1000: of the estimate from many
  bool own_frames = true;     // windows of the clip itself, outside its gaps, count as the library's
  double max_gap_s = 4;       // 0.1 to 20: longer gaps are refused
  int calibration_gaps = 96;  // 0 to 2000: gaps filled at each of a few lengths to learn how large errors are; 0: the
                              // uncertainty is the model's own and too large or too small
  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

class FillLibrary;
struct FillCalibration;

// What a library knows about gaps. Set up once, used for many clips; copies share what they hold; may be used by
// several threads at once.
class FillModel {
 public:
  // From clips of one joint tree. Throws Error{usage} for no clips, Error{bad_input} for clips of two trees. Holds the
  // library's curves at 30 Hz: 0.4 kB a frame.
  [[nodiscard]] static FillModel build(const PreparedSource& clips, const FillOptions& options = {},
                                       const Progress& progress = {});
  // From the clips of a library that have the tree of `skeleton`; throws Error{bad_input} when there are none.
  [[nodiscard]] static FillModel build(LibraryView& library, const Skeleton& skeleton, const FillOptions& options = {},
                                       const Progress& progress = {});

  [[nodiscard]] const FillOptions& options() const { return options_; }
  [[nodiscard]] int clips() const;
  [[nodiscard]] double duration_s() const;  // of all its clips
  [[nodiscard]] const FillLibrary& library() const { return *library_; }
  [[nodiscard]] const FillCalibration& calibration() const { return *calibration_; }

  // How many stated standard deviations cover a share p of errors, as counted on the library; p in [0.01, 0.99].
  // Without calibration that of the normal distribution.
  [[nodiscard]] double interval(double p) const;

 private:
  FillModel(FillOptions options, std::shared_ptr<const FillLibrary> library);
  FillOptions options_;
  std::shared_ptr<const FillLibrary> library_;
  std::shared_ptr<const FillCalibration> calibration_;
};

struct FilledGap {
  FrameRange frames;
  int windows = 0;         // of the library that were looked at; 0: too short a gap to need any
  Eigen::MatrixXf std_cm;  // [frame of the gap][joint]: standard deviation of the world position along each axis
};

struct FillResult {
  Clip clip;  // all frames that were seen are as they were
  std::vector<FilledGap> gaps;
};

// Fills frames [first, last] of each gap; what the clip holds there does not matter. Gaps in ascending order, seen
// frames between them, before the first and after the last. Throws Error{bad_input}: another skeleton, a gap at an end,
// beyond the clip, longer than max_gap_s or than any window of the library, a frame outside the gaps that is not
// finite.
[[nodiscard]] FillResult fill(const FillModel& model, const Clip& clip, std::span<const FrameRange> gaps);
[[nodiscard]] FillResult fill(const FillModel& model, const Clip& clip, FrameRange gap);

struct FillBetweenOptions {
  double gap_s = 0.5;           // (0, max_gap_s] between the last frame of a and the first of b
  bool keep_placement = false;  // b stays where it is; else it is turned and moved on the ground to where the library's
                                // motions would be after that time
  void validate() const;
};

// a, the gap filled, b, as one clip at a's rate (b must have it too). Errors as fill.
[[nodiscard]] FillResult fill_between(const FillModel& model, const Clip& a, const Clip& b,
                                      const FillBetweenOptions& options = {});

}  // namespace kinespace
