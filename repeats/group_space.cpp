#include "kinespace/repeats/group_space.h"

#include <algorithm>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/frame_moments.h"

namespace kinespace {
namespace {

int chosen_axes(const Eigen::VectorXd& variances, double total, const AxisChoice& choice) {
  const int dimensions = static_cast<int>(variances.size());
  if (choice.axes) return std::clamp(*choice.axes, 1, dimensions);
  const double left = choice.residual ? *choice.residual : (1 - choice.variance) * total;
  double rest = total;
  for (int count = 1; count < dimensions; ++count) {
    rest -= variances(count - 1);
    if (rest <= left) return count;
  }
  return dimensions;
}

}  // namespace

GroupSpace fit_group_space(const FrameTable& table, std::span<const FrameSpan> ranges, const AxisChoice& choice) {
  const FrameMoments moments = frame_moments(table, ranges);
  if (moments.count == 0) {
    throw Error(ErrorKind::usage, {.found = "a group without frames", .expected = "at least one frame"});
  }
  const PrincipalAxes principal = principal_axes(moments.covariance);
  const double total = principal.variances.sum();
  const int count = chosen_axes(principal.variances, total, choice);
  return {moments.mean, principal.axes.leftCols(count), principal.variances.head(count), total};
}

Eigen::MatrixXf GroupSpace::project(const FrameTable& table, std::span<const FrameSpan> ranges) const {
  std::vector<std::int64_t> column;
  std::int64_t frames = 0;
  for (const FrameSpan& range : ranges) {
    column.push_back(frames);
    frames += range.frames();
  }
  Eigen::MatrixXf out(axes.cols(), frames);
  const Eigen::MatrixXf turned = axes.transpose().cast<float>();
  const Eigen::VectorXf origin = mean.cast<float>();
  parallel_for(std::size_t{0}, ranges.size(), [&](std::size_t r) {
    const Eigen::MatrixXf centred = frame_matrix(table, ranges[r]).colwise() - origin;
    out.middleCols(column[r], ranges[r].frames()).noalias() = turned * centred;
  });
  return out;
}

Eigen::MatrixXd GroupSpace::reconstruct(const Eigen::MatrixXd& coefficients) const {
  return (axes * coefficients).colwise() + mean;
}

}  // namespace kinespace
