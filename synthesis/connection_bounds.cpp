#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/detail/connection.h"

namespace kinespace {
namespace {

constexpr int cells = connections::bound_cells;
constexpr int axes = 16;

// The least mean of values over stretches that last at least `length` cells. Within a cell the best border of a stretch
// is a border of the cell, so stretches of whole cells do, up to two cells shorter.
float least_mean(const Eigen::Matrix<float, cells, 1>& values, double length) {
  const int shortest = std::clamp(static_cast<int>(std::ceil(length)) - 2, 1, cells);
  std::array<float, cells + 1> sums{};
  for (int i = 0; i < cells; ++i) sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + values(i);
  float least = std::numeric_limits<float>::max();
  for (int begin = 0; begin + shortest <= cells; ++begin) {
    // A stretch of twice the length has a half that is no worse.
    for (int count = shortest; count < 2 * shortest && begin + count <= cells; ++count) {
      const float sum = sums[static_cast<std::size_t>(begin + count)] - sums[static_cast<std::size_t>(begin)];
      least = std::min(least, sum / static_cast<float>(count));
    }
  }
  return least;
}

}  // namespace

ConnectionBounds::ConnectionBounds(const ConnectionOptions& options, std::span<const ConnectionMotion* const> firsts,
                                   std::span<const ConnectionMotion* const> seconds)
    : shortest_s_(options.shortest_s) {
  if (firsts.empty() || seconds.empty()) return;
  const Eigen::Index curves = firsts[0]->poses.cols();
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(curves);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(curves, curves);
  double count = 0;
  for (const auto& group : {firsts, seconds}) {
    for (const ConnectionMotion* motion : group) {
      const Eigen::RowVectorXd pose = motion->poses.colwise().mean().cast<double>();
      mean += pose;
      covariance += pose.transpose() * pose;
      count += 1;
    }
  }
  mean /= count;
  covariance = covariance / count - mean.transpose() * mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::Index kept = std::min<Eigen::Index>(axes, curves);
  const Eigen::MatrixXf basis = solver.eigenvectors().rightCols(kept).cast<float>();
  const Eigen::RowVectorXf centre = mean.cast<float>();

  const auto tracks = [&](std::span<const ConnectionMotion* const> motions, std::vector<Track>& out) {
    out.resize(motions.size());
    tbb::parallel_for(std::size_t{0}, motions.size(), [&](std::size_t i) {
      const Eigen::MatrixXf poses = motions[i]->poses.rowwise() - centre;
      Track& track = out[i];
      track.length_s = motions[i]->length_s;
      track.spread = motions[i]->spread;
      track.poses.resize(kept + 1, cells);
      track.poses.topRows(kept) = (poses * basis).transpose();
      const Eigen::VectorXf left =
          poses.rowwise().squaredNorm() - track.poses.topRows(kept).colwise().squaredNorm().transpose();
      track.poses.row(kept) = left.cwiseMax(0).cwiseSqrt().transpose();
      track.squares = track.poses.colwise().squaredNorm().transpose();
    });
  };
  tracks(firsts, firsts_);
  tracks(seconds, seconds_);
}

double ConnectionBounds::cm(std::size_t first, std::size_t second) const {
  const Track& a = firsts_[first];
  const Track& b = seconds_[second];
  Eigen::Matrix<float, cells, cells> distance;  // of cell i of a and cell k of b
  distance.noalias() = -2 * a.poses.transpose() * b.poses;
  distance.colwise() += a.squares;
  distance.rowwise() += b.squares.transpose();
  distance = distance.cwiseMax(0).cwiseSqrt();
  distance.colwise() -= a.spread;
  distance.rowwise() -= b.spread.transpose();
  const Eigen::Matrix<float, cells, 1> of_second = distance.colwise().minCoeff().transpose().cwiseMax(0).cwiseAbs2();
  const Eigen::Matrix<float, cells, 1> of_first = distance.rowwise().minCoeff().cwiseMax(0).cwiseAbs2();
  const float least = std::max(least_mean(of_second, shortest_s_ / b.length_s * cells),
                               least_mean(of_first, shortest_s_ / a.length_s * cells));
  constexpr double rounding = 0.999;  // distances are of single precision
  return rounding * 100 * std::sqrt(static_cast<double>(least));
}

}  // namespace kinespace
