#include "kinespace/kernels/dtw.h"

#include <cmath>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/kernels/detail/dtw.h"

namespace kinespace {
namespace {

[[noreturn]] void dtw_misuse(std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.found = std::move(found), .expected = std::move(expected)});
}

// True without a NaN or an infinity: x - x is 0 for every other number.
bool all_finite(std::span<const float> values) {
  float sum = 0;
  for (const float x : values) sum += x - x;
  return sum == 0;
}

void require_finite(const FeatureSet& set, int clip, const char* what) {
  const auto values = set.clip(clip);
  if (all_finite(values)) return;
  std::size_t at = 0;
  while (std::isfinite(values[at])) ++at;
  const auto dims = static_cast<std::size_t>(set.dims);
  throw Error(ErrorKind::bad_input,
              {.found = std::to_string(values[at]) + " in feature " + std::to_string(at % dims) + " of row " +
                        std::to_string(at / dims) + " of " + what + " " + std::to_string(clip),
               .expected = "finite features"});
}

// Checks that a clip is there, and once per clip that it is finite.
class ClipCheck {
 public:
  ClipCheck(const FeatureSet& set, const char* what) : set_(set), what_(what), seen_(set.clips(), false) {}
  void operator()(int clip) {
    if (clip < 0 || clip >= set_.clips()) {
      dtw_misuse(std::string(what_) + " " + std::to_string(clip), "0 to " + std::to_string(set_.clips() - 1));
    }
    if (!seen_[clip]) require_finite(set_, clip, what_);
    seen_[clip] = true;
  }

 private:
  const FeatureSet& set_;
  const char* what_;
  std::vector<bool> seen_;
};

void check(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
           const DtwOptions& options) {
  options.validate();
  queries.validate();
  targets.validate();
  if (queries.dims != targets.dims) {
    dtw_misuse(
        "queries of " + std::to_string(queries.dims) + " features and targets of " + std::to_string(targets.dims),
        "the same features");
  }
  ClipCheck query(queries, "query");
  ClipCheck target(targets, "target");
  for (const auto& pair : pairs) {
    query(pair.query);
    target(pair.target);
  }
}

void normalise(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
               std::span<DtwMatch> matches) {
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (matches[p].found()) {
      matches[p].normalised = matches[p].cost / (queries.rows(pairs[p].query) + targets.rows(pairs[p].target));
    }
  }
}

// Under "auto", pairs that have no clip in common leave most lanes of a processor's kernel empty: the plain form is
// faster.
OpenClDevice* device_for(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
                         const Compute& compute) {
  constexpr std::size_t fewest_lanes = 4;
  auto* device = compute.device_for(KernelFamily::dtw, dtw_detail::flops(queries, targets, pairs));
  if (device == nullptr || compute.choice() != "auto" || !compute.uses_lanes(*device)) return device;
  if (pairs.size() >= fewest_lanes * dtw_detail::group_pairs(queries, targets, pairs).groups) return device;
  compute.count_on_processor(KernelFamily::dtw);
  return nullptr;
}

}  // namespace

std::span<const float> FeatureSet::clip(int clip) const {
  const auto width = static_cast<std::size_t>(dims);
  return std::span(values).subspan(static_cast<std::size_t>(starts[clip]) * width,
                                   static_cast<std::size_t>(rows(clip)) * width);
}

void FeatureSet::add(std::span<const float> rows) {
  if (dims < 1 || rows.size() % static_cast<std::size_t>(dims) != 0) {
    dtw_misuse(std::to_string(rows.size()) + " numbers of " + std::to_string(dims) + " features", "whole rows");
  }
  values.insert(values.end(), rows.begin(), rows.end());
  starts.push_back(starts.back() + static_cast<std::int64_t>(rows.size()) / dims);
}

void FeatureSet::validate() const {
  if (dims < 1) dtw_misuse("dims " + std::to_string(dims), "dims >= 1");
  if (starts.empty() || starts.front() != 0 || !std::is_sorted(starts.begin(), starts.end())) {
    dtw_misuse("starts that do not rise from 0", "the first row of each clip, and the number of rows");
  }
  if (static_cast<std::size_t>(starts.back()) * static_cast<std::size_t>(dims) != values.size()) {
    dtw_misuse(std::to_string(values.size()) + " values",
               std::to_string(starts.back()) + " rows of " + std::to_string(dims) + " features");
  }
  for (int c = 0; c < clips(); ++c) {
    if (starts[c + 1] - starts[c] > std::int64_t{1} << 30) dtw_misuse("a clip of over 2^30 rows", "shorter clips");
  }
}

void DtwOptions::validate() const {
  if (!(band_fraction >= 0 && band_fraction <= 1)) {
    dtw_misuse("band_fraction " + std::to_string(band_fraction), "0 (no band) to 1");
  }
  if (path_memory_bytes < (1U << 20)) {
    dtw_misuse("path_memory_bytes " + std::to_string(path_memory_bytes), "1 MiB or more");
  }
}

std::vector<ClipPair> all_pairs(int clips) {
  std::vector<ClipPair> pairs;
  for (int i = 0; i < clips; ++i) {
    for (int j = i + 1; j < clips; ++j) pairs.push_back({i, j});
  }
  return pairs;
}

std::vector<ClipPair> all_pairs(int queries, int targets) {
  std::vector<ClipPair> pairs;
  for (int i = 0; i < queries; ++i) {
    for (int j = 0; j < targets; ++j) pairs.push_back({i, j});
  }
  return pairs;
}

std::vector<DtwMatch> dtw(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
                          const DtwOptions& options, const Compute& compute) {
  check(queries, targets, pairs, options);
  std::vector<DtwMatch> matches(pairs.size());
  auto* device = device_for(queries, targets, pairs, compute);
  if (device == nullptr) {
    dtw_detail::dtw_cpu(queries, targets, pairs, options, matches);
  } else {
    std::vector<std::size_t> left_over;
    dtw_detail::dtw_opencl(*device, compute.uses_lanes(*device), queries, targets, pairs, options, matches, left_over);
    if (!left_over.empty()) compute.count_on_processor(KernelFamily::dtw);
    std::vector<ClipPair> rest(left_over.size());
    std::vector<DtwMatch> rest_matches(left_over.size());
    for (std::size_t p = 0; p < rest.size(); ++p) rest[p] = pairs[left_over[p]];
    dtw_detail::dtw_cpu(queries, targets, rest, options, rest_matches);
    for (std::size_t p = 0; p < rest.size(); ++p) matches[left_over[p]] = std::move(rest_matches[p]);
  }
  normalise(queries, targets, pairs, matches);
  return matches;
}

namespace dtw_detail {
namespace {

std::int64_t ceiling(std::int64_t a, std::int64_t b) {
  return a >= 0 ? (a + b - 1) / b : -(-a / b);
}
std::int64_t flooring(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

}  // namespace

Region region_of(std::int64_t n, std::int64_t m, const DtwOptions& options) {
  Region region{.n = n, .m = m, .slope_limited = options.steps == StepPattern::slope_limited};
  if (options.band_fraction > 0 && n > 0 && m > 0) {
    const auto wanted = options.band_fraction * static_cast<double>(n - 1) * static_cast<double>(m - 1);
    region.band = std::max({static_cast<std::int64_t>(wanted), n - 1, m - 1});
  }
  return region;
}

std::int64_t Region::first_row(std::int64_t j) const {
  std::int64_t first = 0;
  if (band >= 0 && m > 1) first = std::max(first, ceiling(j * (n - 1) - band, m - 1));
  if (slope_limited) first = std::max({first, j / 2, n - 2 - 2 * (m - 1 - j)});
  return first;
}

std::int64_t Region::end_row(std::int64_t j) const {
  std::int64_t end = n;
  if (band >= 0 && m > 1) end = std::min(end, flooring(j * (n - 1) + band, m - 1) + 1);
  if (slope_limited) end = std::min({end, 2 * j + 2, n - (m - 1 - j) / 2});
  return end;
}

Grouping group_pairs(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs) {
  std::vector<std::size_t> of_query(static_cast<std::size_t>(queries.clips()), 0);
  std::vector<std::size_t> of_target(static_cast<std::size_t>(targets.clips()), 0);
  for (const auto& pair : pairs) {
    ++of_query[pair.query];
    ++of_target[pair.target];
  }
  const auto groups = [](const std::vector<std::size_t>& counts) {
    std::size_t sum = 0;
    for (const auto count : counts) sum += (count + 15) / 16;
    return sum;
  };
  const auto by_query = groups(of_query);
  const auto by_target = groups(of_target);
  return {.groups = std::min(by_query, by_target), .by_target = by_target < by_query};
}

double flops(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs) {
  double cells = 0;
  for (const auto& pair : pairs) {
    cells += static_cast<double>(queries.rows(pair.query)) * static_cast<double>(targets.rows(pair.target));
  }
  return cells * 3 * queries.dims;
}

}  // namespace dtw_detail
}  // namespace kinespace
