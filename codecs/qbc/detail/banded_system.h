// The least squares system of a curve's control points: symmetric, four bands wide, one right side a dimension.
//
// Unknowns stand in the order of the code: the first end, then each segment's end and its middle. A segment couples its
// start, end and middle; going on smoothly couples the middles on both sides of an end with it. Eliminated from the
// back, a row says where its unknown is best given those before it, when all later ones make up for it, and the
// diagonal what a deviation costs. Private to this folder.
#pragma once

#include <cstddef>
#include <span>

#include "kinespace/codecs/qbc/detail/curve_task.h"

namespace kinespace {

struct BandedRow {
  static constexpr std::size_t bands = 4;
  std::array<double, bands> a{};  // to the unknowns q before it; a[0]: the diagonal
  Point right{};
};

// Where the end (start of segment `break`) and the middle of a segment stand.
[[nodiscard]] constexpr std::size_t end_row(std::size_t at_break) {
  return at_break == 0 ? 0 : 2 * at_break - 1;
}
[[nodiscard]] constexpr std::size_t middle_row(std::size_t segment) {
  return 2 * segment + 2;
}
[[nodiscard]] constexpr std::size_t row_count(std::size_t segments) {
  return 2 * segments + 1;
}

class BandedSystem {
 public:
  BandedSystem(std::span<BandedRow> rows, std::size_t dimensions) : rows_(rows), n_(dimensions) {}

  // The squared error of a segment.
  void add_segment(std::size_t segment, int length, const SegmentSums& sums);
  // weight * (x - target)^2 for an end.
  void add_end(std::size_t at_break, const double* target, double weight);
  // That the middle of `segment` goes on smoothly: weight * (middle - expected)^2, with the middle before it as another
  // unknown, or as it is.
  void add_smoothness(std::size_t segment, double ratio, double weight);
  void add_smoothness_after(std::size_t segment, double ratio, double weight, const double* middle_before);
  void add_smoothness_before(std::size_t segment, double ratio, double weight, const double* middle_after);
  // Makes an unknown a known.
  void fix(std::size_t row, const double* value);

  void eliminate();
  // The best value of an unknown, given those before it.
  [[nodiscard]] double best(std::size_t row, std::size_t d, std::span<const Point> known) const {
    double out = rows_[row].right[d];
    for (std::size_t q = 1; q < BandedRow::bands && q <= row; ++q) out -= rows_[row].a[q] * known[row - q][d];
    return out / rows_[row].a[0];
  }
  [[nodiscard]] double weight(std::size_t row) const { return rows_[row].a[0]; }

 private:
  void add(std::size_t i, std::size_t j, double value) {
    const std::size_t later = i > j ? i : j;
    rows_[later].a[(later - (i > j ? j : i)) % BandedRow::bands] += value;
  }
  std::span<BandedRow> rows_;
  std::size_t n_;
};

}  // namespace kinespace
