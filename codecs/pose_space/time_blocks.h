// Where a clip is cut into the windows that a codec transforms: as long as motion goes on alike, short where it
// changes.
//
// The windows whose estimated bits are least (dynamic programming over window ends on a grid), where
//
//   bits = window_bits + sum over coefficients of 1.5 log2(1 + |z| / step)   for |z| > step / 2
//
// with the natural functions (codecs/stream/natural_functions.h) of each window as transform.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace kinespace {

// Frames where a body is suddenly elsewhere, beside those in `jumps`: ascending. `curves`: [curve][frame], whitened, so
// that the distance from frame to frame is that of the joints together, in units of `unit_cm`.
[[nodiscard]] std::vector<int> find_jumps(
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& curves, double unit_cm,
    std::vector<int> jumps);

struct BlockPlanOptions {
  double grid_s = 0.5;       // window ends lie on multiples of this, in seconds, but for jumps and the end
  int longest_frames = 512;  // of a window, 1 to longest_block (codecs/stream/clip_table.h)
  double window_bits = 40;   // what a window costs by itself
};

// `curves`: [curve][frame], scaled so that the quantiser's step is 1. `jumps`: frames where a window must begin.
// The lengths of the windows.
[[nodiscard]] std::vector<int> plan_blocks(std::span<const double> curves, int curve_count, int frames, double rate_hz,
                                           std::span<const int> jumps, const BlockPlanOptions& options = {});

// The coefficients of one window's curves: the least squares fit of the first `functions` natural functions.
// Fits for a number of points are tabulated once and kept. Safe from several threads.
class WindowTransform {
 public:
  WindowTransform(int points, int functions);
  // curves: [curve][points] with a stride; out: [curve][functions].
  void analyse(const double* curves, std::ptrdiff_t stride, int curve_count, double* out) const;
  [[nodiscard]] int points() const { return points_; }
  [[nodiscard]] int functions() const { return functions_; }

 private:
  int points_;
  int functions_;
  std::vector<double> table_;  // [point of the first half][even functions, then odd ones]
};

// Components that windows are planned by: nearly all of the energy.
inline constexpr int planned_components = 16;

// About how many bits coefficients take at a quantiser step.
[[nodiscard]] double bits_of(std::span<const double> coefficients, double step);

}  // namespace kinespace
