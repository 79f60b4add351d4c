// ALGLIB's minimiser of a smooth function in a box (minbc: an active set method over L-BFGS), in the form of
// numerics/bounded_minimum.h.
#pragma once

#include "kinespace/numerics/bounded_minimum.h"

namespace kinespace {

// As minimise_in_box. What ALGLIB reports as its own error is an Error{machine}.
[[nodiscard]] BoxMinimum alglib_minimise_in_box(const BoxFunction& function, const BoxPoint& start,
                                                const BoxPoint& lower, const BoxPoint& upper,
                                                const BoxOptions& options = {});

}  // namespace kinespace
