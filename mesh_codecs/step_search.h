// The quantiser step that meets a target: what all mesh codecs search for.
#pragma once

#include <functional>

namespace kinespace {

// Where searches for the step of coefficients begin, over the root mean square error.
inline constexpr double first_step = 6;

// The largest step at which `measure` does not exceed `target`, to about `closeness` of the target. `measure` grows
// with the step, roughly; it is asked at most `most` times. 0 when no step down to `least` meets it.
[[nodiscard]] double largest_step(double guess, double least, double target, double closeness, int most,
                                  const std::function<double(double)>& measure);

}  // namespace kinespace
