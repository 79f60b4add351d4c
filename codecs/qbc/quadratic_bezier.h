// Quadratic Bezier break-and-fit (khan2014, section 7): a curve in R^N as connected quadratic Bezier segments.
//
//   Q(t) = (1 - t)^2 P0 + 2 t (1 - t) P1 + t^2 P2,   t = 0 .. 1 in even steps over the frames of a segment
//
// P0 and P2 are points of the data (segments share them), P1 is the least squares fit (equation 9 is misprinted), with
// w_i = 2 t_i (1 - t_i):
//
//   P1 = sum w_i (p_i - (1 - t_i)^2 P0 - t_i^2 P2) / sum w_i^2
//
// Breaks stand every `interval` frames; a segment with a frame farther than the limit from the data is broken at its
// worst frame, until none is. Segments of two or three points are exact. A segment's fit depends on nothing else, so
// the order of breaking does not matter and what was fitted stays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kinespace {

struct BezierFitOptions {
  double max_squared_distance = 18;  // d^2: of no frame is the squared distance larger; units of the data; > 0
  int interval = 80;                 // frames between the first breaks (the paper's Delta), >= 1
  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

struct BezierCurve {
  int dimensions = 0;
  std::vector<int> breaks;      // frames, ascending, the first 0 and the last the last
  std::vector<double> ends;     // [break][dimension]
  std::vector<double> middles;  // [segment][dimension]
  std::int64_t fitted = 0;      // frames that fitting went over, those of segments that were broken again too

  [[nodiscard]] int frames() const { return breaks.back() + 1; }
  [[nodiscard]] int segments() const { return static_cast<int>(breaks.size()) - 1; }
};

// `values` is [dimension][frame], at least one frame and one dimension, finite.
[[nodiscard]] BezierCurve fit_quadratic_bezier(std::span<const double> values, int dimensions,
                                               const BezierFitOptions& options = {});

// Frames [first, first + count) as [dimension][count].
void evaluate(const BezierCurve& curve, int first, int count, std::span<double> out);

// The largest squared distance of a frame of the curve from the data.
[[nodiscard]] double max_squared_distance(const BezierCurve& curve, std::span<const double> values);

}  // namespace kinespace
