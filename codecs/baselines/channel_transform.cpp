#include "codecs/baselines/channel_transform.h"

#include <algorithm>
#include <cmath>

namespace kinespace {

double grid_step(int index) {
  constexpr std::array<double, 8> eighths{1,
                                          1.0905077326652577,
                                          1.1892071150027210,
                                          1.2968395546510096,
                                          1.4142135623730950,
                                          1.5422108254079408,
                                          1.6817928305074290,
                                          1.8340080864093424};
  const int octave = (index >= 0 ? index : index - 7) / 8;
  return std::ldexp(eighths[static_cast<std::size_t>(index - 8 * octave)], octave);
}

int step_index_below(double step) {
  const double index = std::floor(8 * std::log2(std::max(step, 1e-30)) + 1e-6);
  return static_cast<int>(std::clamp<double>(index, -largest_step_index, largest_step_index));
}

double step_for_error(double squared_error, double share, double coefficients, double least) {
  return std::max(least, std::sqrt(12 * share * squared_error / std::max(coefficients, 1.0)));
}

}  // namespace kinespace
