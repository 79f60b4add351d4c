// From a clip with gaps to windows at the model's rate and back. Private to this folder.
#pragma once

#include <vector>

#include "kinespace/synthesis/detail/filling_core.h"

namespace kinespace {

struct GapFrames {
  int windows = 0;
  Eigen::MatrixXf std_cm;  // [frame][joint]
};

// A motion on the ground: about the vertical through the origin, then along it. cm.
struct GroundMove {
  double angle_rad = 0;
  Eigen::Vector3d shift_cm = Eigen::Vector3d::Zero();
};

// A clip made ready: its curves, and what of it is seen.
class FillSetting {
 public:
  // `clip` has any finite values in its gaps; gaps as fill takes them. The model must outlive the setting.
  FillSetting(const FillModel& model, const Clip& clip, std::vector<FrameRange> gaps);

  [[nodiscard]] const ClipCurves& curves() const { return curves_; }

  // Estimates a gap and writes its frames into `curves`, which has those of curves(). 0 windows where the gap is so
  // short that no window has a frame in it. Throws Error{bad_input} where the library has no window as long.
  [[nodiscard]] GapFrames fill_gap(std::size_t gap, ClipCurves& curves) const;

  // How what follows the gap has to be moved to stand where the library's motions that look like both sides would.
  [[nodiscard]] GroundMove placement_after(std::size_t gap) const;

 private:
  // The knots of a gap's window: evenly `step_s` apart, with one on each edge of the gap.
  struct Knots {
    WindowShape shape;
    double step_s = 0;
    SampleMatrix curves;  // rows in the gap are zero quaternions' stand-ins: those at its edge
  };
  [[nodiscard]] Knots knots_of(std::size_t gap) const;
  [[nodiscard]] std::vector<FillTrack> seen_tracks() const;
  [[noreturn]] void fail_too_long(const Knots& knots, std::size_t gap) const;

  const FillModel& model_;
  std::string name_;
  std::vector<FrameRange> gaps_;
  ClipCurves curves_;
  SampleMatrix values_;  // those of the curves, y above the floor
  std::vector<FillTrack> own_;
};

// Half width of the interval that holds a share p of a standard normal variable.
[[nodiscard]] double normal_interval(double p);

}  // namespace kinespace
