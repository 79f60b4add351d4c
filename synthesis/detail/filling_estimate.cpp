#include "kinespace/synthesis/detail/filling_estimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace kinespace {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Gauss kernel of the distances, its width the distance of the window a quarter down the list; sum 1.
VectorXd kernel_weights(std::span<const double> distances) {
  const double width = distances[distances.size() / 4] + 1e-12;
  VectorXd out(static_cast<Index>(distances.size()));
  for (std::size_t i = 0; i < distances.size(); ++i) {
    out(static_cast<Index>(i)) = std::exp(-0.5 * (distances[i] - distances[0]) / width);
  }
  return out / out.sum();
}

double matern(double apart_s, const WindowPrior& prior) {
  const double x = std::numbers::sqrt3 * std::abs(apart_s) / prior.length_s;
  return (1 + x) * std::exp(-x);
}

// The process in time: how the unseen rows follow from the seen ones.
struct Bridge {
  MatrixXd seen_factor;  // L, L L' = V
  MatrixXd gain;         // cov(u, o) V^-1
  VectorXd open;         // variance left in each unseen row
};

Bridge bridge_of(const std::vector<int>& seen, const std::vector<int>& unseen, const WindowPrior& prior) {
  const double variance = prior.scale_m * prior.scale_m;
  const auto covariance = [&](const std::vector<int>& a, const std::vector<int>& b) {
    MatrixXd out(static_cast<Index>(a.size()), static_cast<Index>(b.size()));
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        out(static_cast<Index>(i), static_cast<Index>(j)) = variance * matern((a[i] - b[j]) / filling_rate_hz, prior);
      }
    }
    return out;
  };
  MatrixXd v = covariance(seen, seen);
  v.diagonal().array() += variance * prior.noise * prior.noise;
  const Eigen::LLT<MatrixXd> factor(v);
  const MatrixXd across = covariance(unseen, seen);
  Bridge out;
  out.seen_factor = factor.matrixL();
  out.gain = factor.solve(across.transpose()).transpose();
  out.open = (variance - (out.gain.array() * across.array()).rowwise().sum()).max(0.0);
  return out;
}

}  // namespace

WindowEstimate estimate_window(const FeatureMatrix& members, std::span<const double> distances,
                               const SampleMatrix& seen, const WindowShape& shape, const WindowPrior& prior,
                               std::span<const int> spread_rows) {
  std::vector<int> o;
  std::vector<int> u;
  for (int r = 0; r < shape.frames(); ++r) (shape.seen(r) ? o : u).push_back(r);
  const Bridge bridge = bridge_of(o, u, prior);

  const Index curves = seen.cols();
  const auto count = std::min<Index>(prior.windows, members.rows());
  const VectorXd weight = kernel_weights(distances.first(static_cast<std::size_t>(count)));
  const Eigen::RowVectorXd mean_row = weight.transpose() * members.topRows(count).cast<double>();
  const Eigen::Map<const SampleMatrix> mean(mean_row.data(), shape.frames(), curves);

  // What each window differs from the mean: whitened where seen, and in the gap less what the bridge would put there.
  // Single precision is enough: rounding is far below the identity that the Gram matrix is added to.
  const auto n_o = static_cast<Index>(o.size());
  const auto n_u = static_cast<Index>(u.size());
  const Eigen::MatrixXf gain = bridge.gain.cast<float>();
  const Eigen::MatrixXf seen_factor = bridge.seen_factor.cast<float>();
  const Eigen::RowVectorXf mean_float = mean_row.cast<float>();
  FeatureMatrix whitened(count, n_o * curves);
  FeatureMatrix beyond(count, n_u * curves);
  FeatureMatrix difference(shape.frames(), curves);
  for (Index k = 0; k < count; ++k) {
    Eigen::Map<Eigen::RowVectorXf>(difference.data(), difference.size()) =
        (members.row(k) - mean_float) * static_cast<float>(std::sqrt(weight(k)));
    FeatureMatrix part = difference(o, Eigen::all);
    Eigen::Map<FeatureMatrix>(beyond.row(k).data(), n_u, curves) = difference(u, Eigen::all) - gain * part;
    seen_factor.triangularView<Eigen::Lower>().solveInPlace(part);
    Eigen::Map<FeatureMatrix>(whitened.row(k).data(), n_o, curves) = part;
  }
  SampleMatrix misfit = seen(o, Eigen::all) - mean(o, Eigen::all);
  SampleMatrix estimate = mean(u, Eigen::all) + bridge.gain * misfit;
  bridge.seen_factor.triangularView<Eigen::Lower>().solveInPlace(misfit);

  Eigen::MatrixXf gram = Eigen::MatrixXf::Zero(count, count);
  gram.selfadjointView<Eigen::Lower>().rankUpdate(whitened);
  MatrixXd precision = gram.cast<double>();
  precision.diagonal().array() += 1;
  const Eigen::LLT<MatrixXd> factor(precision.selfadjointView<Eigen::Lower>());
  const Eigen::VectorXf shown =
      whitened * Eigen::Map<const Eigen::VectorXd>(misfit.data(), misfit.size()).cast<float>();
  const VectorXd scores = factor.solve(shown.cast<double>());
  const Eigen::RowVectorXf change = scores.transpose().cast<float>() * beyond;
  Eigen::Map<Eigen::RowVectorXd>(estimate.data(), estimate.size()) += change.cast<double>();

  WindowEstimate out{.mean = std::move(estimate), .modes = {}, .open_variance = {}};
  const Eigen::MatrixXf lower_factor = MatrixXd(factor.matrixL()).cast<float>();
  out.open_variance.resize(static_cast<Index>(spread_rows.size()));
  for (std::size_t i = 0; i < spread_rows.size(); ++i) {
    // cov z = L^-T L^-1: with E what the windows do in this row, the rows of L^-1 E are the modes.
    Eigen::MatrixXf modes = beyond.middleCols(spread_rows[i] * curves, curves);
    lower_factor.triangularView<Eigen::Lower>().solveInPlace(modes);
    out.modes.emplace_back(modes.transpose());
    out.open_variance(static_cast<Index>(i)) = bridge.open(spread_rows[i]);
  }
  return out;
}

}  // namespace kinespace
