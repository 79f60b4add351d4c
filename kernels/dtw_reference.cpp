// The plain double loop.
#include <cmath>
#include <cstdint>

#include "kinespace/kernels/detail/dtw.h"

namespace kinespace::reference {
namespace {

using dtw_detail::Region;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double distance(const float* a, const float* b, int dims, bool squared) {
  double sum = 0;
  for (int k = 0; k < dims; ++k) {
    const double difference = static_cast<double>(a[k]) - b[k];
    sum += difference * difference;
  }
  return squared ? sum : std::sqrt(sum);
}

const float* row_of(std::span<const float> clip, int row, int dims) {
  return clip.data() + static_cast<std::ptrdiff_t>(row) * dims;
}

// D of a row and, for slope limits, the part of it that was reached diagonally (else the same).
struct Row {
  explicit Row(int m) : cost(m + 1, kInfinity), straight(m + 1, kInfinity) {}
  std::vector<double> cost;  // [j + 1]
  std::vector<double> straight;
};

DtwMatch match_pair(std::span<const float> a, std::span<const float> b, int dims, const DtwOptions& options) {
  const int n = static_cast<int>(a.size()) / dims;
  const int m = static_cast<int>(b.size()) / dims;
  const Region region = dtw_detail::region_of(n, m, options);
  DtwMatch match;
  if (!region.has_path()) return match;
  std::vector<std::uint8_t> steps(options.want_path ? static_cast<std::size_t>(n) * m : 0);
  Row above(m);
  Row here(m);
  above.cost[0] = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double diagonal = above.cost[j];
      const double left = here.straight[j];
      const double up = above.straight[j + 1];
      const double d =
          region.in_band(i, j) ? distance(row_of(a, i, dims), row_of(b, j, dims), dims, options.squared) : kInfinity;
      here.cost[j + 1] = d + std::min(diagonal, std::min(left, up));
      here.straight[j + 1] = region.slope_limited ? d + diagonal : here.cost[j + 1];
      if (options.want_path && diagonal > std::min(left, up)) {
        steps[static_cast<std::size_t>(i) * m + j] = left <= up ? dtw_detail::along_target : dtw_detail::along_query;
      }
    }
    std::swap(above, here);
    here.cost[0] = kInfinity;
  }
  match.cost = above.cost[m];
  if (options.want_path && match.found()) {
    match.path = dtw_detail::trace_back(n, m, region.slope_limited,
                                        [&](int i, int j) { return steps[static_cast<std::size_t>(i) * m + j]; });
  }
  return match;
}

}  // namespace

std::vector<DtwMatch> dtw(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
                          const DtwOptions& options) {
  std::vector<DtwMatch> matches;
  matches.reserve(pairs.size());
  for (const auto& pair : pairs) {
    const auto a = queries.clip(pair.query);
    const auto b = targets.clip(pair.target);
    matches.push_back(match_pair(a, b, queries.dims, options));
    const auto rows = static_cast<double>(a.size() + b.size()) / queries.dims;
    if (matches.back().found()) matches.back().normalised = matches.back().cost / rows;
  }
  return matches;
}

}  // namespace kinespace::reference
