// Internal: what the forms of batched DTW share.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "kinespace/kernels/dtw.h"

namespace kinespace::dtw_detail {

// How a cell was reached; two bits.
enum Step : unsigned { diagonal = 0, along_target = 1, along_query = 2 };  // from (i-1,j-1), (i,j-1), (i-1,j)

// The legal cells of one pair: the band and, with slope limits, the parallelogram from which both ends can be reached.
struct Region {
  std::int64_t n = 0;
  std::int64_t m = 0;
  std::int64_t band = -1;  // bound of |i (m-1) - j (n-1)|; -1: no band
  bool slope_limited = false;

  [[nodiscard]] bool has_path() const { return n > 0 && m > 0 && (!slope_limited || (n <= 2 * m && m <= 2 * n)); }
  // The band only: the other cells never get a finite cost, or none that counts.
  [[nodiscard]] bool in_band(std::int64_t i, std::int64_t j) const {
    const auto off = i * (m - 1) - j * (n - 1);
    return band < 0 || (off <= band && off >= -band);
  }
  // Legal cells of column j lie in rows [first, last + 1); both bounds rise with j.
  [[nodiscard]] std::int64_t first_row(std::int64_t j) const;
  [[nodiscard]] std::int64_t end_row(std::int64_t j) const;
};

[[nodiscard]] Region region_of(std::int64_t n, std::int64_t m, const DtwOptions& options);
[[nodiscard]] inline Region transposed(Region region) {
  std::swap(region.n, region.m);
  return region;
}

// Walks back from (n-1, m-1); step_at(i, j) gives the Step that reached a cell.
template <typename StepAt>
std::vector<FramePair> trace_back(int n, int m, bool slope_limited, const StepAt& step_at) {
  std::vector<FramePair> path;
  path.reserve(static_cast<std::size_t>(n) + static_cast<std::size_t>(m));
  int i = n - 1;
  int j = m - 1;
  bool straight = false;  // the step after this cell was straight, so that the cell was reached diagonally
  while (true) {
    path.push_back({i, j});
    if (i == 0 && j == 0) break;
    const unsigned step = slope_limited && straight ? unsigned{diagonal} : step_at(i, j);
    straight = step != diagonal;
    i -= step == along_target ? 0 : 1;
    j -= step == along_query ? 0 : 1;
  }
  std::reverse(path.begin(), path.end());
  return path;
}

// The floating-point operations of the distances of all pairs.
[[nodiscard]] double flops(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs);

// How many groups of up to sixteen pairs with a clip in common there are, with queries or with targets in common,
// whichever gives fewer.
struct Grouping {
  std::size_t groups = 0;
  bool by_target = false;
};
[[nodiscard]] Grouping group_pairs(const FeatureSet& queries, const FeatureSet& targets,
                                   std::span<const ClipPair> pairs);

// One form per file. The processor's takes any pair; the device's leaves pairs that do not fit its memory or its 32-bit
// arithmetic to `left_over` (indices into pairs).
void dtw_cpu(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
             const DtwOptions& options, std::span<DtwMatch> matches);
void dtw_opencl(OpenClDevice& device, bool lanes, const FeatureSet& queries, const FeatureSet& targets,
                std::span<const ClipPair> pairs, const DtwOptions& options, std::span<DtwMatch> matches,
                std::vector<std::size_t>& left_over);

}  // namespace kinespace::dtw_detail
