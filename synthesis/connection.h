// Where one motion goes over into another (yoo2019, section 6.2, eq. 15).
//
// Motion 1 is left and motion 2 is entered: f1 are the last `window_s` seconds of the first (at most its second half),
// f2 the first `window_s` seconds of the second (at most its first half), each over its own time [0, 1]. The scale u
// and the shift v are sought for which motion 1 at time u s + v is most like motion 2 at time s,
//
//   E(u, v) = 1 / |S| integral over S of  sum_c w_c^2 (r_c f1_c(u s + v) - f2_c(s))^2 ds,
//   S = {s : s, u s + v in [0, 1]}
//
// the mean over the overlap S, not the integral: else the smallest overlap always wins. The curves c are those that a
// rigid motion in the ground plane leaves as they are (curve_sampler.h), so that places and directions do not count;
// curves that are rates change with the speed of play, r_c = u L1 / L2, other r_c = 1. w_c turns a curve into metres.
//
// With f(s) = sum_k x_k b_k(s) in K orthonormal functions of the motion space, E is a sum of three forms in the scores,
//
//   E = <P, S11> - 2 <Q, S12> + <W, S22>,
//   P = mean b(u s + v) b(u s + v)',  Q = mean b(u s + v) b(s)',  W = mean b(s) b(s)'
//
// and P, Q, W do not depend on the motions: they are tabulated once over a grid of (u, v). From the best cells of the
// grid a minimiser in bounds goes down to the nearest minimum, to 1e-7 of the range (numerics/bounded_minimum.h).
//
// Legal: the overlap lasts at least `shortest_s` by the clock of either motion, and motion 1 is played at 1/2 to 2
// times the speed of motion 2.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "kinespace/fpca/registered_space.h"
#include "kinespace/numerics/bounded_minimum.h"
#include "kinespace/synthesis/curve_sampler.h"

namespace kinespace {
namespace connections {
class FunctionCurves;
class PairCost;
struct LegalRange;
}  // namespace connections

struct ConnectionOptions {
  double window_s = 2;      // (0.1, 20]; how much of the end of one and of the start of the other may overlap
  double shortest_s = 0.3;  // [0.1, window_s]; the smallest overlap by either clock
  int functions = 20;       // 4 .. 64 of the space: K
  BoxMinimiser minimiser = minimise_in_box;  // what refines (u, v); any that keeps to its contract finds the same

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// The end or the start of a motion, as connections see it.
struct ConnectionMotion {
  double start_s = 0;      // of the clip
  double length_s = 0;     // L
  Eigen::MatrixXf scores;  // K x C, each curve times its w_c
  Eigen::MatrixXf poses;  // weighted curves that are no rates, [bound cell][curve]: what bounds a connection from below
  Eigen::VectorXf spread;       // how far the motion gets from that pose within the cell
  Eigen::MatrixXd rates, rest;  // K x K: the motion's own parts of S, of curves that are rates and of the rest
};

struct Connection {
  double scale = 1;     // u, in the motions' own times [0, 1]
  double shift = 0;     // v
  double cost_cm = 0;   // sqrt(E) in cm: the root mean square distance of the joints, roughly
  int evaluations = 0;  // of E, that the refinement took
  // The overlap by the clocks of the two clips, in seconds.
  double leave_s = 0, left_s = 0;     // of the first: where it begins and where it ends
  double enter_s = 0, entered_s = 0;  // of the second
  // How fast the first is played where the second has speed 1.
  [[nodiscard]] double speed() const { return (left_s - leave_s) / (entered_s - enter_s); }
};

class ConnectionSpace {
 public:
  ConnectionSpace(const RegisteredSpace& space, const ConnectionOptions& options = {});
  // With functions that were kept (as functions() gives them) from an earlier state of the space.
  ConnectionSpace(const RegisteredSpace& space, SampleMatrix functions, const ConnectionOptions& options);

  // Of clips whose curves are on the space's side (MotionSpace::apply_references). Throws Error{usage} when half of the
  // clip is shorter than the smallest overlap.
  [[nodiscard]] ConnectionMotion end_of(const ClipCurves& clip) const;
  [[nodiscard]] ConnectionMotion start_of(const ClipCurves& clip) const;
  // Any stretch of a clip.
  [[nodiscard]] ConnectionMotion stretch_of(const CurveSampler& clip, double start_s, double length_s) const;
  // Whether the clip is long enough to be left or entered.
  [[nodiscard]] bool long_enough(double duration_s) const { return duration_s / 2 >= options_.shortest_s; }

  struct Limits {
    // Costs above are of no interest: no connection when the grid has nothing within 1.4 times of that.
    double give_up_cm = std::numeric_limits<double>::infinity();
    double largest_speed = 2;  // 1 to 2: motion 1 is played at most so much faster or slower than motion 2
  };
  // The best connection over the whole legal range, in which the overlap lasts `shortest_s` (that of the options when
  // 0) or longer; none when there is no legal (u, v).
  [[nodiscard]] std::optional<Connection> connect(const ConnectionMotion& first, const ConnectionMotion& second,
                                                  double shortest_s, const Limits& limits) const;
  [[nodiscard]] std::optional<Connection> connect(const ConnectionMotion& first, const ConnectionMotion& second,
                                                  double shortest_s = 0) const {
    return connect(first, second, shortest_s, Limits{});
  }

  // E(u, v) of eq. 15, in square metres, for one (u, v); infinity where it is not legal.
  [[nodiscard]] double cost(const ConnectionMotion& first, const ConnectionMotion& second, double u, double v,
                            double shortest_s = 0) const;
  [[nodiscard]] const ConnectionOptions& options() const { return options_; }
  // [point][function]: K functions on a regular grid over [0, 1], orthonormal.
  [[nodiscard]] const SampleMatrix& functions() const { return functions_; }

 private:
  struct Cells {  // all shifts of one scale
    double u = 0;
    std::vector<double> shifts;
    std::vector<double> overlaps;                                                 // |S|
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> grams;  // [shift][P, 2Q, W]
  };
  struct Minimum;
  void tabulate();
  void interpolate(double x, float* out, Eigen::Index step = 1) const;  // out[k * step]
  [[nodiscard]] std::vector<Minimum> minima_of_table(const connections::PairCost& cost,
                                                     const connections::LegalRange& range) const;

  ConnectionOptions options_;
  Eigen::RowVectorXd weights_;    // w_c of the invariant curves
  Eigen::RowVectorXd reference_;  // taken off each curve before it is scored: changes no difference, keeps digits
  SampleMatrix functions_;
  std::shared_ptr<const connections::FunctionCurves> curves_;                   // the functions between their points
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> fine_;  // the functions, finely
  std::vector<Cells> table_;
};

// Bounds from below what connections cost, so that hopeless pairs need not be tried. The integrand of E is at least the
// squared distance of the nearest two poses, so that E is at least the least mean of min_t |f1(t) - f2(s)|^2 over a
// legal stretch of s, and the same with the motions changed over. Poses are compared along the main axes of all
// motions, with what these leave of each pose as one more coordinate: distances only become smaller.
class ConnectionBounds {
 public:
  // Of motions of one space; they need not live on.
  ConnectionBounds(const ConnectionOptions& options, std::span<const ConnectionMotion* const> firsts,
                   std::span<const ConnectionMotion* const> seconds);

  // No connection of firsts[i] to seconds[k] costs less (sqrt(E) in cm).
  [[nodiscard]] double cm(std::size_t first, std::size_t second) const;

 private:
  struct Track {
    double length_s = 0;
    Eigen::MatrixXf poses;  // [axis][cell]
    Eigen::VectorXf squares, spread;
  };
  double shortest_s_;
  std::vector<Track> firsts_, seconds_;
};

namespace reference {
// The best (u, v) of a fine grid over the legal range, its borders included, each E by direct integration of the
// curves' difference: what connect is tested against.
[[nodiscard]] std::optional<Connection> connect(const ConnectionSpace& space, const ConnectionMotion& first,
                                                const ConnectionMotion& second, int scales = 97, int shifts = 400);
}  // namespace reference

}  // namespace kinespace
