#include "kinespace/codecs/qbc/detail/banded_system.h"

#include <algorithm>

namespace kinespace {

void BandedSystem::add_segment(std::size_t segment, int length, const SegmentSums& sums) {
  const std::size_t e0 = end_row(segment), e1 = end_row(segment + 1), m = middle_row(segment);
  const BernsteinGram& g = bernstein_gram(length);
  add(e0, e0, g.g00), add(e0, e1, g.g02), add(e1, e1, g.g22);
  add(e0, m, g.g01), add(e1, m, g.g12), add(m, m, g.g11);
  for (std::size_t d = 0; d < n_; ++d) {
    rows_[e0].right[d] += sums.r0[d], rows_[e1].right[d] += sums.r2[d], rows_[m].right[d] += sums.r1[d];
  }
  if (length > 1) return;
  // Nothing asks for a middle here: the chord's.
  constexpr double tie = 1e-6;
  add(m, m, tie), add(e0, m, -tie / 2), add(e1, m, -tie / 2);
  add(e0, e0, tie / 4), add(e1, e1, tie / 4), add(e0, e1, tie / 4);
}

void BandedSystem::add_end(std::size_t at_break, const double* target, double weight) {
  const std::size_t e = end_row(at_break);
  add(e, e, weight);
  for (std::size_t d = 0; d < n_; ++d) rows_[e].right[d] += weight * target[d];
}

// middle - (1 + ratio) end + ratio * middle before
void BandedSystem::add_smoothness(std::size_t segment, double ratio, double weight) {
  const std::size_t before = middle_row(segment - 1), e = end_row(segment), m = middle_row(segment);
  const double k = 1 + ratio;
  add(m, m, weight), add(e, e, weight * k * k), add(before, before, weight * ratio * ratio);
  add(m, e, -weight * k), add(m, before, weight * ratio), add(e, before, -weight * k * ratio);
}

void BandedSystem::add_smoothness_after(std::size_t segment, double ratio, double weight, const double* middle_before) {
  const std::size_t e = end_row(segment), m = middle_row(segment);
  const double k = 1 + ratio;
  add(m, m, weight), add(e, e, weight * k * k), add(m, e, -weight * k);
  for (std::size_t d = 0; d < n_; ++d) {
    rows_[m].right[d] -= weight * ratio * middle_before[d];
    rows_[e].right[d] += weight * k * ratio * middle_before[d];
  }
}

void BandedSystem::add_smoothness_before(std::size_t segment, double ratio, double weight, const double* middle_after) {
  const std::size_t before = middle_row(segment - 1), e = end_row(segment);
  const double k = 1 + ratio;
  add(e, e, weight * k * k), add(before, before, weight * ratio * ratio), add(e, before, -weight * k * ratio);
  for (std::size_t d = 0; d < n_; ++d) {
    rows_[before].right[d] -= weight * ratio * middle_after[d];
    rows_[e].right[d] += weight * k * middle_after[d];
  }
}

void BandedSystem::fix(std::size_t row, const double* value) {
  for (std::size_t q = 1; q < BandedRow::bands; ++q) {
    if (row >= q) {
      for (std::size_t d = 0; d < n_; ++d) rows_[row - q].right[d] -= rows_[row].a[q] * value[d];
      rows_[row].a[q] = 0;
    }
    if (row + q < rows_.size()) {
      for (std::size_t d = 0; d < n_; ++d) rows_[row + q].right[d] -= rows_[row + q].a[q] * value[d];
      rows_[row + q].a[q] = 0;
    }
  }
  rows_[row].a[0] = 1;
  std::copy_n(value, n_, rows_[row].right.begin());
}

void BandedSystem::eliminate() {
  for (std::size_t i = rows_.size(); i-- > 1;) {
    const BandedRow& row = rows_[i];
    const auto lower = [&](BandedRow& to, double factor) {
      for (std::size_t d = 0; d < n_; ++d) to.right[d] -= factor * row.right[d];
    };
    const double f1 = row.a[1] / row.a[0], f2 = row.a[2] / row.a[0], f3 = row.a[3] / row.a[0];
    BandedRow& one = rows_[i - 1];
    one.a[0] -= f1 * row.a[1], one.a[1] -= f1 * row.a[2], one.a[2] -= f1 * row.a[3];
    lower(one, f1);
    if (i < 2) continue;
    BandedRow& two = rows_[i - 2];
    two.a[0] -= f2 * row.a[2], two.a[1] -= f2 * row.a[3];
    lower(two, f2);
    if (i < 3) continue;
    rows_[i - 3].a[0] -= f3 * row.a[3];
    lower(rows_[i - 3], f3);
  }
}

}  // namespace kinespace
