#include "kinespace/fpca/cut_join.h"

namespace kinespace {
namespace {

// Typical change of slope from frame to frame inside a sequence, by curve.
Eigen::RowVectorXd typical_change(const SampleMatrix& frames) {
  if (frames.rows() < 3) return Eigen::RowVectorXd::Zero(frames.cols());
  const Eigen::Index n = frames.rows() - 2;
  return ((frames.topRows(n) - 2 * frames.middleRows(1, n) + frames.bottomRows(n)).colwise().squaredNorm() /
          static_cast<double>(n))
      .cwiseSqrt();
}

// The part of `change` beyond +- `allowed`.
Eigen::RowVectorXd excess(const Eigen::RowVectorXd& change, const Eigen::RowVectorXd& allowed) {
  return (change.array().abs() - allowed.array()).max(0.0) * change.array().sign();
}

}  // namespace

Fade fade(double x, double blend) {
  const double u = 1 - x / blend;
  if (u <= 0) return {};
  const double u3 = u * u * u;
  return {u3 * (10 - 15 * u + 6 * u * u), (1 - u) * u3 * (1 + 3 * (1 - u))};
}

double fade_steepness(double intervals, double blend) {
  const double first = intervals > 0 ? fade(1 / intervals, blend).slope : 0;
  return first > 0 ? 1 / first : 0;
}

CutCorrection cut_correction(const SampleMatrix& left, const SampleMatrix& right, double free_change) {
  const Eigen::Index n = left.rows() - 1;
  CutCorrection out;
  out.value = (right.row(0) - left.row(n)) / 2;
  out.slope_before = Eigen::RowVectorXd::Zero(left.cols());
  if (n >= 1 && right.rows() >= 2) {
    const Eigen::RowVectorXd change = (right.row(1) - right.row(0)) - (left.row(n) - left.row(n - 1));
    const Eigen::RowVectorXd allowed = free_change * (typical_change(left) + typical_change(right)) / 2;
    out.slope_before = excess(change, allowed) / 2;
  }
  out.slope_after = out.slope_before;
  return out;
}

}  // namespace kinespace
