#include "kinespace/synthesis/playback_basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kinespace {
namespace {

// T x (1 + n): the mean and the first n functions of a group; zeros where it has fewer.
SampleMatrix entries_of(const FunctionGroup& group, int n) {
  SampleMatrix out = SampleMatrix::Zero(group.mean.size(), n + 1);
  out.col(0) = group.mean;
  const Eigen::Index k = std::min<Eigen::Index>(n, group.functions.cols());
  out.middleCols(1, k) = group.functions.leftCols(k);
  return out;
}

// The four coefficients of each cell of the splines through the columns: rows 4 i .. 4 i + 3 belong to cell i.
SampleMatrix cell_coefficients(const SampleMatrix& samples) {
  const UniformSpline spline(samples);
  const Eigen::Index cells = samples.rows() - 1;
  SampleMatrix out(4 * cells, samples.cols());
  Eigen::RowVectorXd middle(samples.cols());
  Eigen::RowVectorXd slope(samples.cols());
  for (Eigen::Index i = 0; i < cells; ++i) {
    const auto x = static_cast<double>(i);
    // Two ends, the slope at the first and the middle say which cubic it is.
    spline.value(x + 0.5, middle);
    // The last sample of a cell belongs to the next one, whose slope there is the same.
    spline.derivative(x, slope);
    const auto low = samples.row(i);
    const auto change = samples.row(i + 1) - low;
    out.row(4 * i) = low;
    out.row(4 * i + 1) = slope;
    out.row(4 * i + 2) = 8 * (middle - low) - 3 * slope - change;
    out.row(4 * i + 3) = 2 * change - 8 * (middle - low) + 2 * slope;
  }
  return out;
}

// Appends the entries of one block from `rows`, zeros where there are none.
template <typename Rows>
void append(const Rows& rows, int block, AlignedVector<float>& out) {
  constexpr Eigen::Index lanes = PlaybackBasis::lanes;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    for (Eigen::Index k = block * lanes; k < (block + 1) * lanes; ++k) {
      out.push_back(k < rows.cols() ? static_cast<float>(rows(i, k)) : 0.0F);
    }
  }
}

// What integrate_travel of fpca/encoding.cpp does to the samples, for each warp term.
std::vector<SampleMatrix> integrals_of(const SampleMatrix& entries) {
  const Eigen::Index points = entries.rows();
  const double step = 1.0 / static_cast<double>(points - 1);
  std::vector<SampleMatrix> out;
  for (int j = 0; j < PlaybackBasis::warp_terms; ++j) {
    SampleMatrix rate = entries;
    for (Eigen::Index i = 0; i < points; ++i) {
      rate.row(i) *= std::cos(j * std::numbers::pi * static_cast<double>(i) * step) * step;
    }
    out.push_back(UniformSpline(std::move(rate)).cumulative_integral());
  }
  return out;
}

}  // namespace

PlaybackBasis::PlaybackBasis(const MotionSpace& space, int functions)
    : functions_(functions < 0 ? space.functions() : std::min(functions, space.functions())),
      points_(space.points()),
      blocks_((functions_ + 1 + lanes - 1) / lanes),
      by_component_(space.options().grouping != Grouping::per_joint_component),
      one_velocity_group_(space.group_of(0) == space.group_of(1)) {
  for (int c = 0; c < space.curves(); ++c) group_of_.push_back(space.group_of(c));
  for (const FunctionGroup& group : space.groups()) {
    const SampleMatrix cubics = cell_coefficients(entries_of(group, functions_));
    for (int block = 0; block < blocks_; ++block) append(cubics, block, values_);
  }
  for (int axis = 0; axis < (one_velocity_group_ ? 1 : 3); ++axis) {
    const FunctionGroup& group = space.groups()[static_cast<std::size_t>(space.group_of(axis))];
    const std::vector<SampleMatrix> integrals = integrals_of(entries_of(group, functions_));
    std::vector<SampleMatrix> cubics;
    for (const SampleMatrix& integral : integrals) cubics.push_back(cell_coefficients(integral));
    for (int block = 0; block < blocks_; ++block) {
      for (Eigen::Index cell = 0; cell + 1 < points_; ++cell) {
        for (const SampleMatrix& c : cubics) append(c.middleRows(4 * cell, 4), block, integrals_);
      }
      for (const SampleMatrix& integral : integrals) append(integral.bottomRows(1), block, ends_);
    }
  }
}

}  // namespace kinespace
