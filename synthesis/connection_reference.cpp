#include <cmath>

#include "kinespace/motion/uniform_spline.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/detail/connection.h"

namespace kinespace::reference {

using namespace connections;

std::optional<Connection> connect(const ConnectionSpace& space, const ConnectionMotion& first,
                                  const ConnectionMotion& second, int scales, int shifts) {
  constexpr int points = 200;
  const double shortest = space.options().shortest_s;
  const UniformSpline functions(space.functions());
  const auto curves_at = [&](const ConnectionMotion& motion, double x, Eigen::RowVectorXd& out) {
    Eigen::RowVectorXd row(space.functions().cols());
    functions.value(x * static_cast<double>(space.functions().rows() - 1), row);
    out = row * motion.scores.cast<double>();
  };
  // Each motion's curves on a fine grid, so that the many evaluations below share them.
  constexpr int grid = 2001;
  SampleMatrix of_first(grid, first.scores.cols()), of_second(grid, second.scores.cols());
  Eigen::RowVectorXd row;
  for (int i = 0; i < grid; ++i) {
    curves_at(first, static_cast<double>(i) / (grid - 1), row);
    of_first.row(i) = row;
    curves_at(second, static_cast<double>(i) / (grid - 1), row);
    of_second.row(i) = row;
  }
  const auto at = [](const SampleMatrix& curves, double x) -> Eigen::RowVectorXd {
    const double p = std::clamp(x, 0.0, 1.0) * (grid - 1);
    const auto i = std::min(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(grid - 2));
    const double b = p - static_cast<double>(i);
    return (1 - b) * curves.row(i) + b * curves.row(i + 1);
  };

  std::optional<Connection> best;
  double least = infinite;
  for (int i = 0; i < scales; ++i) {
    const double speed = least_speed * std::pow(largest_speed / least_speed, static_cast<double>(i) / (scales - 1));
    const double u = speed * second.length_s / first.length_s;
    const Interval legal = shifts_for(u, least_overlap_of(first, second, u, shortest));
    if (legal.begin > legal.end) continue;
    for (int k = 0; k < shifts; ++k) {
      const double v = legal.begin + legal.length() * k / (shifts - 1);
      const Interval s = overlap_of(u, v);
      double sum = 0;
      for (int p = 0; p < points; ++p) {
        const double x = s.begin + s.length() * (p + 0.5) / points;
        Eigen::RowVectorXd difference = at(of_first, u * x + v);
        difference.head<InvariantPose::rates>() *= speed;
        sum += (difference - at(of_second, x)).squaredNorm();
      }
      if (sum / points < least) {
        least = sum / points;
        best = Connection{.scale = u, .shift = v, .cost_cm = 100 * std::sqrt(least)};
      }
    }
  }
  return best;
}

}  // namespace kinespace::reference
