// One joint's channels as the encoder of qbc sees them. Private to this folder.
#pragma once

#include <array>
#include <vector>

namespace kinespace {

inline constexpr int most_dimensions = 6;     // the travel root: three positions, three turns
inline constexpr int longest_segment = 1024;  // frames; the largest interval

// What is quantised how finely, and what a bit is worth.
struct CurveTask {
  int frames = 0;
  int dimensions = 0;
  std::vector<double> values;  // [frame][dimension], in the units of the limit
  double limit = 18;           // largest squared distance of any frame
  int interval = 160;          // frames between the breaks that all joints have
  int grid = 1;                // breaks stand on multiples of so many frames of an interval
  int step_index = 0;  // the quantiser step of a control point that counts for some 16 frames is quarter_step of it
  double smoothness = 0.2;  // bits that a kink of one step counts when control points are fitted
  double rate_weight = 1;   // squared error that a bit is worth

  [[nodiscard]] const double* at(int frame) const {
    return values.data() + static_cast<std::size_t>(frame) * static_cast<std::size_t>(dimensions);
  }
};

// 2^(-index / 4), the same on every machine.
[[nodiscard]] double quarter_step(int index);

using Point = std::array<double, most_dimensions>;

// Sums over frames 1 .. m of a segment of m frames of the products of the three Bernstein polynomials at t = f / m.
struct BernsteinGram {
  double g00 = 0, g01 = 0, g02 = 0, g11 = 0, g12 = 0, g22 = 0;
};
// Lengths up to longest_segment.
[[nodiscard]] const BernsteinGram& bernstein_gram(int length);

// What a segment (first, last] asks of its control points: the squared error of any is
//
//   square - 2 sum_k r_k P_k + sum_kl P_k g_kl P_l
struct SegmentSums {
  Point r0{}, r1{}, r2{};
  double square = 0;
};
// Of any segment that crosses no common break, from running sums of frames times 1, t, t^2.
class RunningSums {
 public:
  explicit RunningSums(const CurveTask& task);
  [[nodiscard]] SegmentSums segment(int first, int last) const;

 private:
  struct Sums {
    Point one{}, linear{}, quadratic{};
    double square = 0;
  };
  int interval_;
  std::size_t n_;
  std::vector<Sums> sums_;  // by frame, from the frame behind the last common break on
};

// The same with the best middle: a form in the ends alone.
struct ReducedGram {
  double g00 = 0, g02 = 0, g22 = 0;
};
[[nodiscard]] const ReducedGram& reduced_gram(int length);

}  // namespace kinespace
