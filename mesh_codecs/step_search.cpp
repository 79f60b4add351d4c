#include "kinespace/mesh_codecs/step_search.h"

#include <algorithm>
#include <cmath>

namespace kinespace {

double largest_step(double guess, double least, double target, double closeness, int most,
                    const std::function<double(double)>& measure) {
  double good = 0, bad = 0, step = std::max(guess, least);
  double good_value = 0, bad_value = 0;
  constexpr double no_change = 0.002;  // where the step is so large that nothing is coded, it changes nothing
  for (int i = 0; i < most; ++i) {
    const double value = measure(step);
    const bool same_as_good = good > 0 && bad == 0 && value <= good_value * (1 + no_change);
    const bool same_as_bad = bad > 0 && good == 0 && value >= bad_value * (1 - no_change);
    if (same_as_good && step > good) break;
    if (value <= target) {
      good = step;
      good_value = value;
      if (value >= target * (1 - closeness)) break;
    } else {
      bad = step;
      bad_value = value;
      if (step <= least) return 0;
    }
    if (good > 0 && bad > 0) {
      if (bad / good < 1 + closeness / 4) break;
      // Between the two by the secant in logarithms, kept off the ends.
      double share = good_value > 0 && bad_value > good_value
                         ? std::log(target / good_value) / std::log(bad_value / good_value)
                         : 0.5;
      share = std::clamp(share - 0.05, 0.1, 0.9);
      step = good * std::pow(bad / good, share);
    } else {
      const double ratio = value > 0 ? target / value : 4;
      step *= same_as_bad ? 0.2 : std::clamp(good > 0 ? ratio * 1.02 : ratio * 0.97, 0.1, 4.0);
      step = std::max(step, least);
    }
  }
  return good;
}

}  // namespace kinespace
