#include "kinespace/codecs/clip_pca/detail/clip_clusters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "kinespace/base/parallel.h"
#include "kinespace/fpca/symmetric_eigen.h"

namespace kinespace {
namespace {

constexpr int compared_components = 16;
constexpr int least_members = 24;

ClusterSpace space_of(const Eigen::MatrixXf& rows, std::vector<int> members) {
  ClusterSpace out{.members = std::move(members), .mean = {}, .axes = {}, .variances = {}, .total_variance = 0};
  const auto n = static_cast<Eigen::Index>(out.members.size());
  Eigen::MatrixXd x(n, rows.cols());
  for (Eigen::Index i = 0; i < n; ++i) x.row(i) = rows.row(out.members[static_cast<std::size_t>(i)]).cast<double>();
  out.mean = x.colwise().mean().transpose();
  x.rowwise() -= out.mean.transpose();
  out.total_variance = x.squaredNorm() / static_cast<double>(n);
  SymmetricEigen eigen;
  const bool by_rows = n <= rows.cols();
  const Eigen::VectorXd values = eigen.decompose(by_rows ? Eigen::MatrixXd(x * x.transpose() / static_cast<double>(n))
                                                         : Eigen::MatrixXd(x.transpose() * x / static_cast<double>(n)));
  Eigen::Index count = 0;
  while (count < values.size() && values(count) > 1e-9 * std::max(values(0), 1e-12)) ++count;
  count = std::max<Eigen::Index>(count, 1);
  const Eigen::MatrixXd vectors = eigen.vectors(static_cast<int>(count));
  out.variances = values.head(count).cwiseMax(0);
  out.axes = by_rows ? Eigen::MatrixXd(x.transpose() * vectors) : vectors;
  for (Eigen::Index a = 0; a < count; ++a) {
    const double length = out.axes.col(a).norm();
    if (length > 1e-12) {
      out.axes.col(a) /= length;
    } else {
      out.axes.col(a).setZero();
    }
  }
  return out;
}

// k-means from rows that are farthest from those before.
std::vector<int> assign(const Eigen::MatrixXd& z, int clusters) {
  constexpr int rounds = 20;
  const Eigen::Index n = z.rows();
  Eigen::MatrixXd centres(clusters, z.cols());
  Eigen::VectorXd nearest = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::infinity());
  Eigen::Index next = 0;
  (z.rowwise() - z.colwise().mean()).rowwise().squaredNorm().minCoeff(&next);
  for (int c = 0; c < clusters; ++c) {
    centres.row(c) = z.row(next);
    nearest = nearest.cwiseMin((z.rowwise() - centres.row(c)).rowwise().squaredNorm());
    nearest.maxCoeff(&next);
  }
  std::vector<int> out(static_cast<std::size_t>(n), 0);
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(clusters, z.cols());
    Eigen::VectorXd counts = Eigen::VectorXd::Zero(clusters);
    bool changed = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::Index best = 0;
      (centres.rowwise() - z.row(i)).rowwise().squaredNorm().minCoeff(&best);
      changed = changed || out[static_cast<std::size_t>(i)] != best;
      out[static_cast<std::size_t>(i)] = static_cast<int>(best);
      sums.row(best) += z.row(i);
      counts(best) += 1;
    }
    if (!changed && round > 0) break;
    for (int c = 0; c < clusters; ++c) {
      if (counts(c) > 0) centres.row(c) = sums.row(c) / counts(c);
    }
  }
  return out;
}

// In bytes, about.
double cost_of(const std::vector<ClusterSpace>& spaces, double share, Eigen::Index dimensions) {
  constexpr double bytes_of_entry = 0.8;
  constexpr double bytes_of_coefficient = 1.9;
  double out = 0;
  for (const ClusterSpace& space : spaces) {
    out += space.axes_for(share) * (bytes_of_entry * static_cast<double>(dimensions) +
                                    bytes_of_coefficient * static_cast<double>(space.members.size()));
    out += static_cast<double>(dimensions);
  }
  return out;
}

}  // namespace

int ClusterSpace::axes_for(double share) const {
  double kept = 0;
  for (Eigen::Index a = 0; a < variances.size(); ++a) {
    kept += variances(a);
    if (kept >= share * total_variance) return static_cast<int>(a) + 1;
  }
  return static_cast<int>(variances.size());
}

std::vector<ClusterSpace> cluster_spaces(const Eigen::MatrixXf& rows, double share, int most_clusters) {
  std::vector<int> all(static_cast<std::size_t>(rows.rows()));
  std::iota(all.begin(), all.end(), 0);
  std::vector<ClusterSpace> best{space_of(rows, std::move(all))};
  double least = cost_of(best, share, rows.cols());
  const Eigen::Index compared = std::min<Eigen::Index>(compared_components, best.front().axes.cols());
  const Eigen::MatrixXd z =
      (rows.cast<double>().rowwise() - best.front().mean.transpose()) * best.front().axes.leftCols(compared);
  for (int clusters = 2; clusters <= most_clusters && clusters * least_members <= rows.rows(); clusters *= 2) {
    const std::vector<int> cluster = assign(z, clusters);
    std::vector<std::vector<int>> members(static_cast<std::size_t>(clusters));
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      members[static_cast<std::size_t>(cluster[i])].push_back(static_cast<int>(i));
    }
    std::erase_if(members, [](const std::vector<int>& m) { return m.empty(); });
    std::vector<ClusterSpace> spaces(members.size());
    parallel_for(std::size_t{0}, members.size(), [&](std::size_t c) { spaces[c] = space_of(rows, members[c]); });
    const double cost = cost_of(spaces, share, rows.cols());
    if (cost >= least) break;
    least = cost;
    best = std::move(spaces);
  }
  return best;
}

}  // namespace kinespace
