#include "kinespace/codecs/baselines/detail/channel_transform.h"

#include <algorithm>
#include <cmath>

namespace kinespace {

double grid_step(int index) {
  const int octave = (index >= 0 ? index : index - steps_per_octave + 1) / steps_per_octave;
  int rest = index - steps_per_octave * octave;
  // Square roots are the same on every machine; powers are not.
  double out = 1, root = 2;
  for (int bit = steps_per_octave / 2; bit > 0; bit /= 2) {
    root = std::sqrt(root);
    if (rest < bit) continue;
    out *= root;
    rest -= bit;
  }
  return std::ldexp(out, octave);
}

int step_index_below(double step) {
  const double index = std::floor(steps_per_octave * std::log2(std::max(step, 1e-30)) + 1e-6);
  return static_cast<int>(std::clamp<double>(index, -largest_step_index, largest_step_index));
}

double step_for_error(double squared_error, double share, double coefficients, double least) {
  return std::max(least, std::sqrt(12 * share * squared_error / std::max(coefficients, 1.0)));
}

}  // namespace kinespace
