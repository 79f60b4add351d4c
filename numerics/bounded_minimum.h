// The least value of a smooth function of a few variables in a box, from a start: a local minimum.
//
//   minimise_in_box   projected BFGS (Bertsekas 1982, "Projected Newton methods"): Newton steps with a damped BFGS
//                     matrix (Powell 1978) in the variables that no border holds, along the path that the box bends,
//                     shortened until the value falls enough (Armijo).
//
// ALGLIB's minimiser (alglib/minimum.h) has the same form, so that one can stand for the other.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace kinespace {

constexpr int most_box_variables = 8;
using BoxPoint = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_box_variables, 1>;

// The value at x, and its gradient.
using BoxFunction = std::function<double(const BoxPoint& x, BoxPoint& gradient)>;

struct BoxOptions {
  double last_step = 1e-7;     // (0, 1), of the box's width: a step so short in every variable is the last
  double first_step = 0.1;     // (0, 1], of the box's width: how far the first step may go
  int most_evaluations = 200;  // >= 1

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

struct BoxMinimum {
  BoxPoint at;
  double value = 0;
  int evaluations = 0;
  bool converged = false;  // false: out of evaluations, or rounding hides what is left to win
};

// `lower` <= `upper`, variable by variable; where they are equal the variable is fixed. A start outside is moved to the
// border. The value found is never above that at the start. Throws Error{usage} for more than most_box_variables, sizes
// that differ and borders that cross. Same bits for the same function whatever the machine.
[[nodiscard]] BoxMinimum minimise_in_box(const BoxFunction& function, const BoxPoint& start, const BoxPoint& lower,
                                         const BoxPoint& upper, const BoxOptions& options = {});

// One of the implementations.
using BoxMinimiser = BoxMinimum (*)(const BoxFunction& function, const BoxPoint& start, const BoxPoint& lower,
                                    const BoxPoint& upper, const BoxOptions& options);

// What every implementation asks of its arguments; throws Error{usage}.
void require_box(const BoxPoint& start, const BoxPoint& lower, const BoxPoint& upper, const BoxOptions& options);

}  // namespace kinespace
