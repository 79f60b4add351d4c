// How many bits a coefficient is worth (lin2011, section 5.2).
//
// Axis v of a group has one quantiser step, from the range of its curves and the error that may be expected of it:
//
//   n    = ceil(log2(Range_v / E) - 2)                                                         (8)
//   step = Range_v / 2^n          q = floor((h - min) / step)          h' = min + (q + 1/2) step    (7)
//
// min: that of the curve, so that q >= 0. The middle of the step is off by a quarter of it on average: E or less. The
// paper takes E = 0.5 cm for primary and unique clips and 0.6 cm for repeated ones, whose ranges are small.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace kinespace {

inline constexpr double primary_tolerance_cm = 0.5;
inline constexpr double repeated_tolerance_cm = 0.6;
inline constexpr int most_quantiser_bits = 30;

// Equation 8; 0 where the range is within four times the error.
[[nodiscard]] inline int adaptive_bits(double range, double expected_error) {
  if (!(range > 4 * expected_error)) return 0;
  return std::min(most_quantiser_bits, static_cast<int>(std::ceil(std::log2(range / expected_error) - 2)));
}

// Equation 7. `least` is the curve's minimum as the decoder has it.
struct UniformQuantiser {
  double least = 0;
  double step = 1;  // > 0

  [[nodiscard]] std::int64_t quantise(double value) const {
    return static_cast<std::int64_t>(std::floor((value - least) / step));
  }
  [[nodiscard]] double value(std::int64_t quantised) const {
    return least + (static_cast<double>(quantised) + 0.5) * step;
  }
};

}  // namespace kinespace
