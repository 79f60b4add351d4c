// E(u, v) of one pair of motions (connection.h) with its slopes, in double: what the refinement of a connection follows.
#pragma once

#include <array>

#include <Eigen/Core>

#include "kinespace/motion/uniform_spline.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/detail/connection.h"

namespace kinespace::connections {

constexpr int overlap_points = 32;  // of the integral over an overlap: midpoints of equal parts
constexpr int most_functions = 64;

// Which of the ends of the overlap lies inside motion 2, and so moves with u and v: E is smooth as long as neither
// changes, and has an edge where one does (v = 0 and u + v = 1).
struct OverlapEnds {
  bool begin_moves = false;  // v <= 0: S begins at -v / u, where motion 1 begins
  bool end_moves = false;    // u + v >= 1: S ends at (1 - v) / u, where motion 1 ends
};
[[nodiscard]] inline OverlapEnds ends_of(double u, double v) {
  return {.begin_moves = v<0, .end_moves = u + v> 1};
}

// The functions between the points of their grid, as cubics with continuous curvature.
class FunctionCurves {
 public:
  FunctionCurves() = default;
  explicit FunctionCurves(const SampleMatrix& functions);  // [point][function], at most most_functions

  [[nodiscard]] Eigen::Index count() const { return knots_.cols() / 2; }
  // values[k * step] and slopes[k * step] of function k at x, clamped to [0, 1].
  void at(double x, double* values, double* slopes, Eigen::Index step) const;

 private:
  SampleMatrix knots_;  // [point][values, slopes by the point]
};

class PairCost {
 public:
  // All three must outlive it.
  PairCost(const FunctionCurves& functions, const ConnectionMotion& first, const ConnectionMotion& second);

  // E in square metres, and its slopes in u and v with the ends of the overlap as said.
  double operator()(double u, double v, OverlapEnds ends, Eigen::Vector2d& slopes) const;
  [[nodiscard]] double operator()(double u, double v) const;

  // The forms of the scores that do not change with u: S12 of the curves that are rates, and of the others. K x K.
  [[nodiscard]] const Eigen::MatrixXd& cross_rates() const { return cross_rates_; }
  [[nodiscard]] const Eigen::MatrixXd& cross_rest() const { return cross_rest_; }

 private:
  const FunctionCurves& functions_;
  const ConnectionMotion& first_;
  const ConnectionMotion& second_;
  Eigen::MatrixXd cross_rates_, cross_rest_;
};

}  // namespace kinespace::connections
