#include "kinespace/repeats/detail/frame_moments.h"

#include <algorithm>
#include <vector>

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

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

class SumBody {
 public:
  SumBody(const FrameTable& table, std::span<const FrameSpan> blocks, const Eigen::VectorXd& origin)
      : table_(table), blocks_(blocks), origin_(origin) {
    clear();
  }
  SumBody(SumBody& other, tbb::split /*tag*/) : table_(other.table_), blocks_(other.blocks_), origin_(other.origin_) {
    clear();
  }
  void operator()(const tbb::blocked_range<std::size_t>& range) {
    Eigen::MatrixXd frames;
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      frames = frame_matrix(table_, blocks_[b]).cast<double>().colwise() - origin_;
      sums_.sum += frames.rowwise().sum();
      sums_.products.selfadjointView<Eigen::Lower>().rankUpdate(frames);
    }
  }
  void join(const SumBody& other) {
    sums_.sum += other.sums_.sum;
    sums_.products += other.sums_.products;
  }
  [[nodiscard]] const Sums& sums() const { return sums_; }

 private:
  void clear() {
    sums_.sum = Eigen::VectorXd::Zero(table_.dimensions);
    sums_.products = Eigen::MatrixXd::Zero(table_.dimensions, table_.dimensions);
  }

  const FrameTable& table_;
  std::span<const FrameSpan> blocks_;
  const Eigen::VectorXd& origin_;
  Sums sums_;
};

}  // namespace

FrameMoments frame_moments(const FrameTable& table, std::span<const FrameSpan> ranges) {
  const std::vector<FrameSpan> blocks = blocks_of(ranges);
  FrameMoments out;
  out.mean = Eigen::VectorXd::Zero(table.dimensions);
  out.covariance = Eigen::MatrixXd::Zero(table.dimensions, table.dimensions);
  for (const FrameSpan& block : blocks) out.count += block.frames();
  if (out.count == 0) return out;

  const Eigen::VectorXd origin = frame_matrix(table, {blocks.front().first, blocks.front().first + 1}).cast<double>();
  SumBody body(table, blocks, origin);
  const std::size_t grain = std::max<std::size_t>(8, blocks.size() / 32);
  tbb::parallel_deterministic_reduce(tbb::blocked_range<std::size_t>(0, blocks.size(), grain), body);
  throw_if_cancelled();
  const double n = static_cast<double>(out.count);
  const Eigen::VectorXd shift = body.sums().sum / n;
  out.mean = origin + shift;
  out.covariance = body.sums().products.selfadjointView<Eigen::Lower>();
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
