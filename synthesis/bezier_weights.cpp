#include <algorithm>
#include <cmath>
#include <limits>

#include "kinespace/synthesis/interpolation.h"

namespace kinespace {
namespace {

// The motion, beyond the first `through`, that is nearest to the point with these weights; -1 when none is within
// `radius`.
Eigen::Index nearest_other(const Eigen::MatrixXd& vectors, int through, const Eigen::VectorXd& weights, double radius) {
  const Eigen::RowVectorXd point = weights.transpose() * vectors;
  Eigen::Index best = -1;
  double least = radius;
  for (Eigen::Index i = through; i < vectors.rows(); ++i) {
    const double distance = (vectors.row(i) - point).norm();
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

}  // namespace

BezierWeights::BezierWeights(Eigen::MatrixXd controls) : controls_(std::move(controls)) {}

BezierWeights BezierWeights::through_motions(const Eigen::MatrixXd& vectors, int through) {
  const Eigen::Index motions = vectors.rows();
  const auto unit = [&](int i) -> Eigen::VectorXd { return Eigen::VectorXd::Unit(motions, i); };
  // From each motion a third of the way along the curve's direction there; the way back is its mirror image.
  std::vector<Eigen::VectorXd> ahead(static_cast<std::size_t>(through));
  for (int i = 0; i < through; ++i) {
    const int before = std::max(i - 1, 0), after = std::min(i + 1, through - 1);
    const Eigen::VectorXd direction = (unit(after) - unit(before)) / std::max(after - before, 1);
    Eigen::VectorXd ideal = unit(i) + direction / 3;
    const double radius = (direction.transpose() * vectors).norm() / 3;
    // The last motion's own control point lies before it, so its mirror image is what has to be real.
    const bool last = i == through - 1;
    const Eigen::VectorXd wanted = last ? Eigen::VectorXd(2 * unit(i) - ideal) : ideal;
    const Eigen::Index real = nearest_other(vectors, through, wanted, radius);
    if (real >= 0) {
      const Eigen::VectorXd control = Eigen::VectorXd::Unit(motions, real);
      ideal = last ? Eigen::VectorXd(2 * unit(i) - control) : control;
    }
    ahead[static_cast<std::size_t>(i)] = ideal;
  }
  Eigen::MatrixXd controls(3 * (through - 1) + 1, motions);
  for (int i = 0; i + 1 < through; ++i) {
    controls.row(3 * i) = unit(i).transpose();
    controls.row(3 * i + 1) = ahead[static_cast<std::size_t>(i)].transpose();
    controls.row(3 * i + 2) = (2 * unit(i + 1) - ahead[static_cast<std::size_t>(i) + 1]).transpose();
  }
  controls.row(3 * (through - 1)) = unit(through - 1).transpose();
  return BezierWeights(std::move(controls));
}

Eigen::VectorXd BezierWeights::at(double t) const {
  t = std::clamp(t, 0.0, static_cast<double>(segments()));
  const int segment = std::min(static_cast<int>(t), std::max(segments() - 1, 0));
  if (segments() == 0) return controls_.row(0).transpose();
  const double x = t - segment, y = 1 - x;
  const auto p = controls_.middleRows(3L * segment, 4);
  return (y * y * y * p.row(0) + 3 * x * y * y * p.row(1) + 3 * x * x * y * p.row(2) + x * x * x * p.row(3))
      .transpose();
}

}  // namespace kinespace
