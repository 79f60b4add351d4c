#include "kinespace/synthesis/vector_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "kinespace/kernels/simd.h"

namespace kinespace {
namespace {

constexpr int first_groups = 16;  // whose best blocks are visited before the others are sorted
using Vector = float __attribute__((vector_size(vector_lanes * sizeof(float))));

constexpr float infinity = std::numeric_limits<float>::infinity();

// Bounds of `groups` times 16 blocks: to the box, plus the difference of the norms of the rest.
KINESPACE_SIMD_BODY void box_bounds_body(const float* boxes, std::ptrdiff_t groups, std::ptrdiff_t boxed,
                                         const float* query, float rest, float* out) {
  const std::ptrdiff_t sides = 2 * (boxed + 1);
  for (std::ptrdiff_t g = 0; g < groups; ++g) {
    const float* box = boxes + g * sides * vector_lanes;
    Vector sum{};
    for (std::ptrdiff_t d = 0; d <= boxed; ++d) {
      const float q = d < boxed ? query[d] : rest;
      Vector low;
      Vector high;
      std::memcpy(&low, box + 2 * d * vector_lanes, sizeof(Vector));
      std::memcpy(&high, box + (2 * d + 1) * vector_lanes, sizeof(Vector));
      const Vector below = low - q;
      const Vector above = q - high;
      Vector away = below > above ? below : above;
      away = away > 0.0F ? away : Vector{};
      sum += away * away;
    }
    std::memcpy(out + g * vector_lanes, &sum, sizeof(Vector));
  }
}
KINESPACE_SIMD(box_bounds, void,
               (const float* boxes, std::ptrdiff_t groups, std::ptrdiff_t boxed, const float* query, float rest,
                float* out),
               (boxes, groups, boxed, query, rest, out))

// Sums of a block's rows, level by level; stops when no row can be within the limit. Returns a bit for each row that
// may be.
KINESPACE_SIMD_BODY unsigned scan_block_body(const float* values, const float* rests, const float* query,
                                             const float* query_rests, const int* levels, int level_count,
                                             float limit) {
  Vector sum{};
  int d = 0;
  unsigned alive = 0;
  for (int level = 0; level < level_count; ++level) {
    for (; d < levels[level]; ++d) {
      Vector x;
      std::memcpy(&x, values + static_cast<std::ptrdiff_t>(d) * vector_lanes, sizeof(Vector));
      x -= query[d];
      sum += x * x;
    }
    Vector rest;
    std::memcpy(&rest, rests + static_cast<std::ptrdiff_t>(level) * vector_lanes, sizeof(Vector));
    rest -= query_rests[level];
    const Vector bound = sum + rest * rest;
    alive = 0;
    for (int l = 0; l < vector_lanes; ++l) alive |= (bound[l] <= limit ? 1U : 0U) << l;
    if (alive == 0) break;
  }
  return alive;
}
KINESPACE_SIMD(scan_block, unsigned,
               (const float* values, const float* rests, const float* query, const float* query_rests,
                const int* levels, int level_count, float limit),
               (values, rests, query, query_rests, levels, level_count, limit))

// out += sum over d of x[d] axes[d][.]
KINESPACE_SIMD_BODY void turn_body(const double* x, const double* axes, std::ptrdiff_t n, double* __restrict out) {
  for (std::ptrdiff_t d = 0; d < n; ++d) {
    const double value = x[d];
    const double* __restrict row = axes + d * n;
    for (std::ptrdiff_t i = 0; i < n; ++i) out[i] += value * row[i];
  }
}
KINESPACE_SIMD(turn, void, (const double* x, const double* axes, std::ptrdiff_t n, double* out), (x, axes, n, out))

// As squared_distance_exact, of a row whose numbers lie `stride` apart.
double squared_distance_strided(const float* x, std::ptrdiff_t stride, std::span<const float> query) {
  std::array<double, 8> sums{};
  const auto n = static_cast<std::ptrdiff_t>(query.size());
  std::ptrdiff_t d = 0;
  for (; d + 8 <= n; d += 8) {
    for (std::ptrdiff_t i = 0; i < 8; ++i) {
      const double difference =
          static_cast<double>(x[(d + i) * stride]) - static_cast<double>(query[static_cast<std::size_t>(d + i)]);
      sums[static_cast<std::size_t>(i)] += difference * difference;
    }
  }
  for (; d < n; ++d) {
    const double difference =
        static_cast<double>(x[d * stride]) - static_cast<double>(query[static_cast<std::size_t>(d)]);
    sums[static_cast<std::size_t>(d % 8)] += difference * difference;
  }
  return ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
}

}  // namespace

// The k nearest so far: a heap, the farthest first, and what a float bound may be for a row to come among them.
struct VectorSearch::Found {
  std::vector<std::pair<double, int>>& heap;
  std::size_t k;
  double query_norm;
  double rounding;  // of a float sum, relative
  float limit = infinity;

  void add(double squared, int row) {
    const std::pair<double, int> candidate(squared, row);
    if (heap.size() == k) {
      if (!(candidate < heap.front())) return;
      std::ranges::pop_heap(heap);
      heap.back() = candidate;
    } else {
      heap.push_back(candidate);
    }
    std::ranges::push_heap(heap);
    if (heap.size() == k) set_limit(std::sqrt(heap.front().first));
  }

  // The coordinates of a row at distance D are rounded by 2^-24 of its norm, at most |q| + D, and so are the query's
  // and the norms of the rests: 2^-21 (2 |q| + D) is more than all that. Nothing nearer than D has a larger bound.
  void set_limit(double distance) {
    const double wide = distance + std::ldexp(2 * query_norm + distance, -21);
    const double squared = wide * wide * (1 + rounding);
    limit =
        squared < std::numeric_limits<float>::max() ? std::nextafter(static_cast<float>(squared), infinity) : infinity;
  }
};

double VectorSearch::exact(int block, int lane, const Scratch& scratch) const {
  const auto slot = static_cast<std::size_t>(block) * vector_lanes + static_cast<std::size_t>(lane);
  if (rows_.rows() != 0) return squared_distance_strided(rows_.row(ids_[slot]).data(), 1, scratch.query);
  const std::size_t start = static_cast<std::size_t>(block) * static_cast<std::size_t>(dimensions_) * vector_lanes;
  return squared_distance_strided(values_.data() + start + static_cast<std::size_t>(lane), vector_lanes, scratch.query);
}

void VectorSearch::turn_query(std::span<const float> query, Scratch& scratch) const {
  scratch.query.assign(query.begin(), query.end());
  for (std::size_t d = 0; d < weights_.size(); ++d) scratch.query[d] *= weights_[d];
  scratch.turned = scratch.query;
  if (mean_.size() != 0) {
    const auto n = static_cast<std::size_t>(dimensions_);
    scratch.centred.assign(2 * n, 0.0);
    for (std::size_t d = 0; d < n; ++d) {
      scratch.centred[d] = static_cast<double>(scratch.query[d]) - mean_(static_cast<Eigen::Index>(d));
    }
    turn(scratch.centred.data(), axes_.data(), dimensions_, scratch.centred.data() + n);
    for (std::size_t d = 0; d < n; ++d) scratch.turned[d] = static_cast<float>(scratch.centred[n + d]);
  }
  // Norms of what follows each level; then that of what follows the box, then of all.
  scratch.rest.resize(levels_.size() + 2);
  double sum = 0;
  auto level = static_cast<std::ptrdiff_t>(levels_.size()) - 1;
  for (int d = dimensions_; d >= 0; --d) {
    if (d < dimensions_) {
      const double value = scratch.turned[static_cast<std::size_t>(d)];
      sum += value * value;
    }
    if (level >= 0 && levels_[static_cast<std::size_t>(level)] == d) {
      scratch.rest[static_cast<std::size_t>(level--)] = static_cast<float>(std::sqrt(sum));
    }
    if (d == boxed_) scratch.rest[levels_.size()] = static_cast<float>(std::sqrt(sum));
  }
  scratch.rest[levels_.size() + 1] = static_cast<float>(std::sqrt(sum));
}

void VectorSearch::bound_blocks(Scratch& scratch, std::span<const std::uint8_t> allowed) const {
  const int groups = (blocks_ + vector_lanes - 1) / vector_lanes;
  scratch.bounds.resize(static_cast<std::size_t>(groups) * vector_lanes);
  box_bounds(boxes_.data(), groups, boxed_, scratch.turned.data(), scratch.rest[levels_.size()], scratch.bounds.data());
  std::fill(scratch.bounds.begin() + blocks_, scratch.bounds.end(), infinity);
  if (allowed.empty()) return;
  for (std::size_t b = 0; b < static_cast<std::size_t>(blocks_); ++b) {
    const auto rows = std::span(ids_).subspan(b * vector_lanes, vector_lanes);
    const bool any = std::ranges::any_of(
        rows, [&](std::int32_t id) { return id >= 0 && allowed[static_cast<std::size_t>(id)] != 0; });
    if (!any) scratch.bounds[b] = infinity;
  }
}

void VectorSearch::visit(int block, const Scratch& scratch, std::span<const std::uint8_t> allowed, Found& found) const {
  const auto b = static_cast<std::size_t>(block);
  unsigned alive = scan_block(values_.data() + b * static_cast<std::size_t>(dimensions_) * vector_lanes,
                              rests_.data() + b * levels_.size() * vector_lanes, scratch.turned.data(),
                              scratch.rest.data(), levels_.data(), static_cast<int>(levels_.size()), found.limit);
  for (int l = 0; alive != 0; ++l, alive >>= 1U) {
    if ((alive & 1U) == 0) continue;
    const std::int32_t id = ids_[b * vector_lanes + static_cast<std::size_t>(l)];
    if (id < 0 || (!allowed.empty() && allowed[static_cast<std::size_t>(id)] == 0)) continue;
    found.add(exact(block, l, scratch), id);
  }
}

std::span<const Neighbour> VectorSearch::nearest(std::span<const float> query, int k, Scratch& scratch,
                                                 std::span<const std::uint8_t> allowed) const {
  check(query, k, allowed);
  turn_query(query, scratch);
  bound_blocks(scratch, allowed);
  scratch.nearest.clear();
  Found found{.heap = scratch.nearest,
              .k = static_cast<std::size_t>(std::min<std::int64_t>(k, std::max<std::int64_t>(size_, 1))),
              .query_norm = static_cast<double>(scratch.rest.back()),
              .rounding = std::ldexp(dimensions_ + 16.0, -22)};
  auto& order = scratch.order;

  // The best block of each of the best groups, for a limit to begin with; these are not visited again.
  order.clear();
  for (int start = 0; start < blocks_; start += vector_lanes) {
    const auto best = std::min_element(scratch.bounds.begin() + start, scratch.bounds.begin() + start + vector_lanes);
    order.emplace_back(*best, static_cast<int>(best - scratch.bounds.begin()));
  }
  const auto first = std::min<std::ptrdiff_t>(first_groups, std::ssize(order));
  std::ranges::partial_sort(order, order.begin() + first);
  for (std::ptrdiff_t i = 0; i < first; ++i) {
    const auto [bound, block] = order[static_cast<std::size_t>(i)];
    if (bound > found.limit || bound == infinity) break;
    visit(block, scratch, allowed, found);
    scratch.bounds[static_cast<std::size_t>(block)] = infinity;
  }

  order.clear();
  for (int b = 0; b < blocks_; ++b) {
    const float bound = scratch.bounds[static_cast<std::size_t>(b)];
    if (bound <= found.limit && bound != infinity) order.emplace_back(bound, b);
  }
  std::ranges::sort(order);
  for (const auto& [bound, block] : order) {
    if (bound > found.limit) break;
    visit(block, scratch, allowed, found);
  }

  std::ranges::sort(scratch.nearest);
  scratch.result.clear();
  for (const auto& [squared, row] : scratch.nearest) scratch.result.push_back({row, squared});
  return scratch.result;
}

std::vector<Neighbour> VectorSearch::nearest(std::span<const float> query, int k,
                                             std::span<const std::uint8_t> allowed) const {
  Scratch scratch;
  const auto found = nearest(query, k, scratch, allowed);
  return {found.begin(), found.end()};
}

double squared_distance_exact(std::span<const float> a, std::span<const float> b) {
  return squared_distance_strided(a.data(), 1, b);
}

}  // namespace kinespace
