#include "kinespace/repeats/detail/frame_moments.h"

#include <algorithm>
#include <vector>

#include <Eigen/Eigenvalues>

#include "kinespace/base/parallel.h"

namespace kinespace {
namespace {

constexpr std::int64_t block_frames = 512;

// Ranges cut into blocks of a size that does not depend on the machine.
std::vector<FrameSpan> blocks_of(std::span<const FrameSpan> ranges) {
  std::vector<FrameSpan> out;
  for (const FrameSpan& range : ranges) {
    for (std::int64_t first = range.first; first < range.last; first += block_frames) {
      out.push_back({first, std::min(first + block_frames, range.last)});
    }
  }
  return out;
}

// Sums about an origin near the frames, so that little is lost when the mean is taken away.
struct Sums {
  Eigen::VectorXd sum;
  Eigen::MatrixXd products;  // lower triangle
};

Sums sums_of(const FrameTable& table, std::span<const FrameSpan> blocks, const Eigen::VectorXd& origin) {
  Sums out{Eigen::VectorXd::Zero(table.dimensions), Eigen::MatrixXd::Zero(table.dimensions, table.dimensions)};
  Eigen::MatrixXd frames;
  for (const FrameSpan& block : blocks) {
    frames = frame_matrix(table, block).cast<double>().colwise() - origin;
    out.sum += frames.rowwise().sum();
    out.products.selfadjointView<Eigen::Lower>().rankUpdate(frames);
  }
  return out;
}

// Cut in halves until no part has more than `grain` blocks: sums do not depend on how many processors make them.
void cut_in_halves(std::span<const FrameSpan> blocks, std::size_t grain, std::vector<std::span<const FrameSpan>>& out) {
  if (blocks.size() <= grain) {
    out.push_back(blocks);
    return;
  }
  cut_in_halves(blocks.first(blocks.size() / 2), grain, out);
  cut_in_halves(blocks.subspan(blocks.size() / 2), grain, out);
}

// Adds up the parts of cut_in_halves() the way they were cut.
Sums joined(std::size_t blocks, std::size_t grain, std::vector<Sums>::iterator& next) {
  if (blocks <= grain) return std::move(*next++);
  Sums out = joined(blocks / 2, grain, next);
  const Sums other = joined(blocks - blocks / 2, grain, next);
  out.sum += other.sum;
  out.products += other.products;
  return out;
}

Sums sums_in_parallel(const FrameTable& table, std::span<const FrameSpan> blocks, const Eigen::VectorXd& origin) {
  const std::size_t grain = std::max<std::size_t>(8, blocks.size() / 32);
  std::vector<std::span<const FrameSpan>> parts;
  cut_in_halves(blocks, grain, parts);
  std::vector<Sums> sums(parts.size());
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) { sums[i] = sums_of(table, parts[i], origin); });
  auto next = sums.begin();
  return joined(blocks.size(), grain, next);
}

}  // namespace

FrameMoments frame_moments(const FrameTable& table, std::span<const FrameSpan> ranges) {
  const std::vector<FrameSpan> blocks = blocks_of(ranges);
  FrameMoments out;
  out.mean = Eigen::VectorXd::Zero(table.dimensions);
  out.covariance = Eigen::MatrixXd::Zero(table.dimensions, table.dimensions);
  for (const FrameSpan& block : blocks) out.count += block.frames();
  if (out.count == 0) return out;

  const Eigen::VectorXd origin = frame_matrix(table, {blocks.front().first, blocks.front().first + 1}).cast<double>();
  const Sums sums = sums_in_parallel(table, blocks, origin);
  const double n = static_cast<double>(out.count);
  const Eigen::VectorXd shift = sums.sum / n;
  out.mean = origin + shift;
  out.covariance = sums.products.selfadjointView<Eigen::Lower>();
  out.covariance = out.covariance / n - shift * shift.transpose();
  return out;
}

PrincipalAxes principal_axes(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  PrincipalAxes out{solver.eigenvalues().reverse().cwiseMax(0), solver.eigenvectors().rowwise().reverse()};
  for (Eigen::Index c = 0; c < out.axes.cols(); ++c) {
    Eigen::Index largest = 0;
    out.axes.col(c).cwiseAbs().maxCoeff(&largest);
    if (out.axes(largest, c) < 0) out.axes.col(c) = -out.axes.col(c);
  }
  return out;
}

FrameTable reduced_table(const FrameTable& table, int dimensions) {
  const FrameSpan all{0, table.frames};
  const FrameMoments moments = frame_moments(table, std::span(&all, 1));
  const PrincipalAxes principal = principal_axes(moments.covariance);
  FrameTable out{.rate_hz = table.rate_hz,
                 .dimensions = std::min(dimensions, table.dimensions),
                 .frames = table.frames,
                 .values = {},
                 .starts = table.starts};
  out.values.resize(static_cast<std::size_t>(out.frames) * static_cast<std::size_t>(out.dimensions));
  const Eigen::MatrixXf axes = principal.axes.leftCols(out.dimensions).transpose().cast<float>();
  const Eigen::VectorXf mean = moments.mean.cast<float>();
  const std::vector<FrameSpan> blocks = blocks_of(std::span(&all, 1));
  parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const Eigen::MatrixXf centred = frame_matrix(table, blocks[b]).colwise() - mean;
    Eigen::Map<Eigen::MatrixXf>(out.values.data() + blocks[b].first * out.dimensions, out.dimensions,
                                blocks[b].frames())
        .noalias() = axes * centred;
  });
  return out;
}

}  // namespace kinespace
