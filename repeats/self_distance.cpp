#include "kinespace/repeats/self_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace kinespace {
namespace {

// More than the square of any distance between postures, and far from overflow when two of them are added.
constexpr float gap_square = 1e30F;

}  // namespace

SelfDistance::SelfDistance(const GroupSpace& space, const FrameTable& table, std::span<const FrameSpan> ranges,
                           int stride)
    : ranges_(ranges.begin(), ranges.end()), stride_(stride), rate_hz_(table.rate_hz) {
  assert(stride >= 1);
  for (std::size_t r = 0; r < ranges_.size(); ++r) {
    if (r > 0) run_.push_back(-1);
    first_pixel_.push_back(static_cast<int>(run_.size()));
    run_.resize(run_.size() + static_cast<std::size_t>((ranges_[r].frames() + stride - 1) / stride),
                static_cast<int>(r));
  }
  coefficients_ = Eigen::MatrixXf::Zero(space.axis_count(), static_cast<Eigen::Index>(run_.size()));
  squares_ = Eigen::VectorXf::Constant(static_cast<Eigen::Index>(run_.size()), gap_square);
  const Eigen::MatrixXf all = space.project(table, ranges);
  Eigen::Index frame = 0;
  for (std::size_t r = 0; r < ranges_.size(); ++r) {
    Eigen::Index pixel = first_pixel_[r];
    for (std::int64_t f = 0; f < ranges_[r].frames(); f += stride, ++pixel) {
      coefficients_.col(pixel) = all.col(frame + f);
      squares_(pixel) = coefficients_.col(pixel).squaredNorm();
    }
    frame += ranges_[r].frames();
  }
  typical_ = std::sqrt(2 * std::max(space.variances.sum(), 0.0));
  floor_ = std::max(0.01 * typical_, 1e-6);
}

std::int64_t SelfDistance::frame(int pixel, int run) const {
  const FrameSpan range = ranges_[static_cast<std::size_t>(run)];
  const std::int64_t offset = static_cast<std::int64_t>(pixel - first_pixel_[static_cast<std::size_t>(run)]) * stride_;
  return std::min(range.first + offset, range.last);
}

float SelfDistance::at(int i, int j) const {
  return std::max((coefficients_.col(i) - coefficients_.col(j)).norm(), static_cast<float>(floor_));
}

void SelfDistance::tile(int row, int column, Eigen::Ref<Tile> out) const {
  const auto rows = coefficients_.middleCols(row, out.rows());
  const auto columns = coefficients_.middleCols(column, out.cols());
  out.noalias() = -2.0F * rows.transpose() * columns;
  const auto least = static_cast<float>(floor_ * floor_);
  for (Eigen::Index r = 0; r < out.rows(); ++r) {
    out.row(r) = (out.row(r).array() + (squares_.segment(column, out.cols()).transpose().array() + squares_(row + r)))
                     .cwiseMax(least);
  }
}

}  // namespace kinespace
