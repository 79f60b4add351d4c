#include "kinespace/numerics/bounded_minimum.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Cholesky>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

using BoxMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_box_variables, most_box_variables>;

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::usage, {.found = found, .expected = expected});
}

// The function over the unit cube: one width for all variables, and no units.
class InCube {
 public:
  InCube(const BoxFunction& function, const BoxPoint& lower, const BoxPoint& upper)
      : function_(function), lower_(lower), upper_(upper), width_(upper - lower) {}

  [[nodiscard]] BoxPoint to_cube(const BoxPoint& x) const {
    BoxPoint z(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      z[i] = width_[i] > 0 ? std::clamp((x[i] - lower_[i]) / width_[i], 0.0, 1.0) : 0.0;
    }
    return z;
  }
  // Borders exactly.
  [[nodiscard]] BoxPoint from_cube(const BoxPoint& z) const {
    BoxPoint x = lower_ + z.cwiseProduct(width_);
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      if (z[i] >= 1) x[i] = upper_[i];
    }
    return x;
  }
  double operator()(const BoxPoint& z, BoxPoint& gradient) {
    ++evaluations;
    const double value = function_(from_cube(z), gradient);
    gradient = gradient.cwiseProduct(width_).eval();
    return value;
  }

  int evaluations = 0;

 private:
  const BoxFunction& function_;
  const BoxPoint &lower_, &upper_;
  BoxPoint width_;
};

// -B^-1 g in the variables that can go where that leads; 0 in those that a border holds.
BoxPoint newton_step(const BoxMatrix& hessian, const BoxPoint& z, const BoxPoint& gradient) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const bool held = gradient[i] == 0 || (gradient[i] > 0 ? z[i] <= 0 : z[i] >= 1);
    if (!held) free.push_back(i);
  }
  BoxPoint step = BoxPoint::Zero(z.size());
  // A step that leaves the cube at once in a variable that lies on its border holds that variable, too.
  while (!free.empty()) {
    const BoxMatrix of_free = hessian(free, free);
    const BoxPoint solution = of_free.ldlt().solve(-gradient(free));
    const auto leaves = [&](std::size_t k) {
      const double at = z[free[k]], by = solution[static_cast<Eigen::Index>(k)];
      return (at <= 0 && by < 0) || (at >= 1 && by > 0);
    };
    std::vector<Eigen::Index> staying;
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (!leaves(k)) staying.push_back(free[k]);
    }
    if (staying.size() == free.size()) {
      step(free) = solution;
      break;
    }
    free = std::move(staying);
  }
  return step;
}

// BFGS, with the change of the gradient bent towards B s where the function curves down (Powell 1978).
void update(BoxMatrix& hessian, const BoxPoint& s, BoxPoint y, bool first) {
  const double sy = s.dot(y);
  if (first && sy > 0) hessian = BoxMatrix::Identity(s.size(), s.size()) * (y.squaredNorm() / sy);
  const BoxPoint bs = hessian * s;
  const double sbs = s.dot(bs);
  if (!(sbs > 0)) return;
  constexpr double least_share = 0.2;
  if (sy < least_share * sbs) {
    const double theta = (1 - least_share) * sbs / (sbs - sy);
    y = theta * y + (1 - theta) * bs;
  }
  hessian += y * y.transpose() / s.dot(y) - bs * bs.transpose() / sbs;
}

}  // namespace

void BoxOptions::validate() const {
  if (!(last_step > 0 && last_step < 1)) refuse("last_step = " + std::to_string(last_step), "a share in (0, 1)");
  if (!(first_step > 0 && first_step <= 1)) refuse("first_step = " + std::to_string(first_step), "a share in (0, 1]");
  if (most_evaluations < 1) refuse("most_evaluations = " + std::to_string(most_evaluations), "1 or more");
}

void require_box(const BoxPoint& start, const BoxPoint& lower, const BoxPoint& upper, const BoxOptions& options) {
  options.validate();
  if (start.size() < 1 || lower.size() != start.size() || upper.size() != start.size()) {
    refuse("a start of " + std::to_string(start.size()) + " variables, borders of " + std::to_string(lower.size()) +
               " and " + std::to_string(upper.size()),
           "the same number, at least one");
  }
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    const bool legal = std::isfinite(start[i]) && std::isfinite(lower[i]) && std::isfinite(upper[i]);
    if (!legal || lower[i] > upper[i]) {
      refuse("variable " + std::to_string(i + 1) + " from " + std::to_string(lower[i]) + " to " +
                 std::to_string(upper[i]) + ", started at " + std::to_string(start[i]),
             "finite numbers, the lower border first");
    }
  }
}

BoxMinimum minimise_in_box(const BoxFunction& function, const BoxPoint& start, const BoxPoint& lower,
                           const BoxPoint& upper, const BoxOptions& options) {
  require_box(start, lower, upper, options);
  constexpr double enough = 1e-4;  // of the descent that the slope promises
  constexpr double shortest = 1e-12;
  InCube f(function, lower, upper);
  BoxPoint z = f.to_cube(start), gradient(start.size());
  double value = f(z, gradient);
  const double steepest = gradient.cwiseAbs().maxCoeff();
  BoxMatrix hessian =
      BoxMatrix::Identity(start.size(), start.size()) * (steepest > 0 ? steepest / options.first_step : 1);
  bool first = true, converged = false, stuck = false;
  while (!converged && !stuck) {
    const BoxPoint step = newton_step(hessian, z, gradient);
    converged = step.cwiseAbs().maxCoeff() <= options.last_step;
    double share = 1;
    stuck = !converged;
    while (!converged && f.evaluations < options.most_evaluations && share > shortest) {
      const BoxPoint next = (z + share * step).cwiseMax(0).cwiseMin(1);
      BoxPoint next_gradient(z.size());
      const double next_value = f(next, next_gradient), slope = gradient.dot(next - z);
      if (next_value <= value + enough * slope) {
        // A path that the border cut to nothing.
        converged = (next - z).cwiseAbs().maxCoeff() <= options.last_step;
        update(hessian, next - z, next_gradient - gradient, first);
        first = false;
        z = next;
        gradient = next_gradient;
        value = next_value;
        stuck = false;
        break;
      }
      // The minimum of the parabola through both values and the slope.
      const double parabola = -0.5 * slope / (next_value - value - slope);
      share *= std::isfinite(parabola) ? std::clamp(parabola, 0.1, 0.5) : 0.5;
    }
  }
  return {.at = f.from_cube(z), .value = value, .evaluations = f.evaluations, .converged = converged};
}

}  // namespace kinespace
