#include "kinespace/synthesis/playback_basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kinespace {
namespace {

// T x (1 + rows): the mean, the lines between the ends where they are kept, and the functions of a group; zeros where it
// has fewer.
SampleMatrix entries_of(const FunctionGroup& group, bool pinned, int rows) {
  SampleMatrix out = SampleMatrix::Zero(group.mean.size(), rows + 1);
  out.col(0) = group.mean;
  Eigen::Index next = 1;
  if (pinned && rows >= 2) {
    out.col(1).setLinSpaced(out.rows(), 1, 0);
    out.col(2).setLinSpaced(out.rows(), 0, 1);
    next = 3;
  }
  const Eigen::Index k = std::min<Eigen::Index>(rows + 1 - next, group.functions.cols());
  out.middleCols(next, k) = group.functions.leftCols(k);
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

PlaybackBasis::PlaybackBasis(const RegisteredSpace& space, int levels)
    : levels_(levels < 0 ? space.levels() : std::min(levels, space.levels())),
      by_component_(space.options().grouping != Grouping::per_joint_component),
      one_velocity_group_(space.plain().group_of(0) == space.plain().group_of(1)) {
  if (space.options().pinned) left_out_.emplace(space);
  for (int c = 0; c < space.curves(); ++c) group_of_.push_back(space.plain().group_of(c));
  for (std::size_t set = 0; set < space.sets().size(); ++set) {
    sets_.push_back(space.has(static_cast<int>(set)) ? tables_of(space.sets()[set]) : Set{});
  }
}

PlaybackBasis::Set PlaybackBasis::tables_of(const MotionSpace& space) const {
  Set out{.points = space.points()};
  for (int level = 0; level <= levels_; ++level) out.rows_at.push_back(space.rows_at(level));
  out.rows = out.rows_at.back();
  out.blocks = (out.rows + 1 + lanes - 1) / lanes;
  for (const FunctionGroup& group : space.groups()) {
    const SampleMatrix cubics = cell_coefficients(entries_of(group, space.options().pinned, out.rows));
    for (int block = 0; block < out.blocks; ++block) append(cubics, block, out.values);
  }
  for (int axis = 0; axis < (one_velocity_group_ ? 1 : 3); ++axis) {
    const FunctionGroup& group = space.groups()[static_cast<std::size_t>(space.group_of(axis))];
    const std::vector<SampleMatrix> integrals = integrals_of(entries_of(group, space.options().pinned, out.rows));
    std::vector<SampleMatrix> cubics;
    for (const SampleMatrix& integral : integrals) cubics.push_back(cell_coefficients(integral));
    for (int block = 0; block < out.blocks; ++block) {
      for (Eigen::Index cell = 0; cell + 1 < out.points; ++cell) {
        for (const SampleMatrix& c : cubics) append(c.middleRows(4 * cell, 4), block, out.integrals);
      }
      for (const SampleMatrix& integral : integrals) append(integral.bottomRows(1), block, out.ends);
    }
  }
  return out;
}

}  // namespace kinespace
