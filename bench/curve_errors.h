// How far curves are from what was decoded of them: yoo2019's E (eq. 2), for many.
#pragma once

#include <vector>

#include "kinespace/fpca/curve_moments.h"

namespace kinespace {

class CurveErrors {
 public:
  // Of each row, over [0, 1]: the root of the integral of the squared difference, in the curves' unit. `weights`: of the
  // trapezoid rule there.
  void add(const CurveView& curves, const CurveView& decoded, const Eigen::VectorXd& weights);
  void add(const CurveErrors& others);

  // 0 where there are no curves.
  [[nodiscard]] double average() const;
  [[nodiscard]] double variance() const;
  [[nodiscard]] double largest() const;
  // The least error that this share (0 to 1) of the curves keeps to.
  [[nodiscard]] double percentile(double share) const;
  [[nodiscard]] double root_mean_square() const;

 private:
  std::vector<double> values_;
};

}  // namespace kinespace
