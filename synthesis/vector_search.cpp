#include "kinespace/synthesis/vector_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/symmetric_eigen.h"
#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/projection.h"
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

// How a VectorSearch is made: rows turned, gathered in blocks, and what bounds them.

namespace {

constexpr int most_boxed = 24;
constexpr int most_split = 16;             // leading coordinates that blocks are divided by
constexpr Eigen::Index axes_rows = 16384;  // rows that the principal axes are found from
constexpr Eigen::Index most_rows = 1 << 30;
constexpr float largest_component = 1e12F;  // squares of it times any weight, and their sums, are floats

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::usage, {.found = found, .expected = expected});
}

void check_row(std::span<const float> row, const std::string& what) {
  for (std::size_t d = 0; d < row.size(); ++d) {
    if (std::abs(row[d]) <= largest_component) continue;
    throw Error(ErrorKind::bad_input,
                {.found = fmt::format("{}, dimension {}: {}", what, d, row[d]), .expected = "numbers within +-1e12"});
  }
}

std::span<const float> row_of(const RowMatrix<float>& rows, Eigen::Index i) {
  return {rows.data() + i * rows.cols(), static_cast<std::size_t>(rows.cols())};
}

// Divides rows in two, at the middle of the coordinate that they spread over most, until 16 are left: similar rows come
// to stand side by side. Every part but the last is a multiple of 16.
class Divider {
 public:
  explicit Divider(const RowMatrix<float>& rows)
      : rows_(rows),
        split_(std::min<Eigen::Index>(rows.cols(), most_split)),
        order_(static_cast<std::size_t>(rows.rows())) {
    std::iota(order_.begin(), order_.end(), 0);
    divide(0, order_.size());
  }
  [[nodiscard]] const std::vector<std::int32_t>& order() const { return order_; }

 private:
  [[nodiscard]] Eigen::Index widest(std::size_t begin, std::size_t end) const {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(split_);
    Eigen::ArrayXd squares = sum;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::ArrayXd x = rows_.row(order_[i]).head(split_).cast<double>();
      sum += x;
      squares += x * x;
    }
    Eigen::Index widest = 0;
    (squares - sum * sum / static_cast<double>(end - begin)).maxCoeff(&widest);
    return widest;
  }

  void divide(std::size_t begin, std::size_t end) {
    const std::size_t blocks = (end - begin + vector_lanes - 1) / vector_lanes;
    if (blocks < 2) return;
    const Eigen::Index d = widest(begin, end);
    const std::size_t middle = begin + blocks / 2 * vector_lanes;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::int32_t a, std::int32_t b) {
      return std::pair(rows_(a, d), a) < std::pair(rows_(b, d), b);
    });
    divide(begin, middle);
    divide(middle, end);
  }

  const RowMatrix<float>& rows_;
  Eigen::Index split_;
  std::vector<std::int32_t> order_;
};

std::vector<int> levels_of(int dimensions) {
  std::vector<int> out;
  for (int level = 16; level < dimensions; level *= 2) out.push_back(level);
  out.push_back(dimensions);
  return out;
}

}  // namespace

VectorSearch::VectorSearch(RowMatrix<float> rows, const VectorSearchOptions& options)
    : size_(rows.rows()), dimensions_(static_cast<int>(rows.cols())), weights_(options.weights) {
  if (rows.cols() < 1) refuse("vectors of no dimensions", "one or more");
  if (rows.rows() > most_rows) refuse(fmt::format("{} rows", rows.rows()), "at most 2^30");
  if (!weights_.empty() && std::ssize(weights_) != rows.cols()) {
    refuse(fmt::format("{} weights", weights_.size()), fmt::format("{}, one for each dimension", rows.cols()));
  }
  for (const float w : weights_) {
    if (!(w >= 0 && w <= 1e3F)) refuse(fmt::format("a weight of {}", w), "0 to 1000");
  }
  for (Eigen::Index i = 0; i < rows.rows(); ++i) check_row(row_of(rows, i), fmt::format("row {}", i));
  if (!weights_.empty()) {
    rows.array().rowwise() *= Eigen::Map<const Eigen::RowVectorXf>(weights_.data(), rows.cols()).array();
  }
  boxed_ = std::min(dimensions_, most_boxed);
  levels_ = levels_of(dimensions_);
  if (!options.rotate || rows.rows() < 2) {
    gather(rows);
    return;
  }
  rows_ = std::move(rows);
  RowMatrix<float> turned = rows_;
  turn_rows(turned);
  gather(turned);
}

void VectorSearch::turn_rows(RowMatrix<float>& rows) {
  const Eigen::Index every = std::max<Eigen::Index>(1, rows.rows() / axes_rows);
  const Eigen::Index looked_at = (rows.rows() + every - 1) / every;
  const RowMatrixView<float> some(Eigen::Map<const RowMatrix<float>, 0, Eigen::OuterStride<>>(
      rows.data(), looked_at, rows.cols(), Eigen::OuterStride<>(every * rows.cols())));
  const CurveCovariance moments = covariance(some, 0);
  SymmetricEigen eigen;
  eigen.decompose(moments.covariance);
  mean_ = moments.mean;
  axes_ = eigen.vectors(dimensions_);
  constexpr Eigen::Index part = 1024;
  for (Eigen::Index i = 0; i < rows.rows(); i += part) {
    auto block = rows.middleRows(i, std::min(part, rows.rows() - i));
    const RowMatrix<double> exact = block.cast<double>();
    block = project(exact, mean_, axes_).cast<float>();
  }
}

void VectorSearch::gather(const RowMatrix<float>& rows) {
  const Divider divider(rows);
  blocks_ = static_cast<int>((size_ + vector_lanes - 1) / vector_lanes);
  const auto blocks = static_cast<std::size_t>(blocks_);
  const auto dims = static_cast<std::size_t>(dimensions_);
  const auto boxed = static_cast<std::size_t>(boxed_);
  const std::size_t sides = 2 * (boxed + 1);
  ids_.assign(blocks * vector_lanes, -1);
  std::ranges::copy(divider.order(), ids_.begin());
  values_.assign(blocks * dims * vector_lanes, 0.0F);
  rests_.assign(blocks * levels_.size() * vector_lanes, 0.0F);
  boxes_.assign((blocks + vector_lanes - 1) / vector_lanes * vector_lanes * sides, 0.0F);

  std::vector<double> tail(dims + 1);  // squared norm of the coordinates from d on
  for (std::size_t slot = 0; slot < blocks * vector_lanes; ++slot) {
    const std::size_t block = slot / vector_lanes;
    const std::size_t lane = slot % vector_lanes;
    // Lanes without a row repeat the block's first, which leaves its box alone.
    const auto x = row_of(rows, ids_[slot] >= 0 ? ids_[slot] : ids_[block * vector_lanes]);
    tail[dims] = 0;
    for (std::size_t d = dims; d-- > 0;) tail[d] = tail[d + 1] + static_cast<double>(x[d]) * static_cast<double>(x[d]);
    for (std::size_t d = 0; d < dims; ++d) values_[(block * dims + d) * vector_lanes + lane] = x[d];
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      rests_[(block * levels_.size() + level) * vector_lanes + lane] =
          static_cast<float>(std::sqrt(tail[static_cast<std::size_t>(levels_[level])]));
    }
    float* box = boxes_.data() + block / vector_lanes * sides * vector_lanes + block % vector_lanes;
    for (std::size_t d = 0; d <= boxed; ++d) {
      const float value = d < boxed ? x[d] : static_cast<float>(std::sqrt(tail[boxed]));
      float& low = box[2 * d * vector_lanes];
      float& high = box[(2 * d + 1) * vector_lanes];
      low = lane == 0 ? value : std::min(low, value);
      high = lane == 0 ? value : std::max(high, value);
    }
  }
}

void VectorSearch::check(std::span<const float> query, int k, std::span<const std::uint8_t> allowed) const {
  if (k < 1) refuse(fmt::format("k = {}", k), "1 or more");
  if (std::ssize(query) != dimensions_) {
    refuse(fmt::format("a query of {} numbers", query.size()), fmt::format("{}", dimensions_));
  }
  if (!allowed.empty() && std::ssize(allowed) != size_) {
    refuse(fmt::format("a mask of {} rows", allowed.size()), fmt::format("{}", size_));
  }
  check_row(query, "the query");
}

namespace reference {

std::vector<Neighbour> nearest(const RowMatrixView<float>& rows, std::span<const float> query, int k,
                               std::span<const float> weights, std::span<const std::uint8_t> allowed) {
  std::vector<float> q(query.begin(), query.end());
  for (std::size_t d = 0; d < weights.size(); ++d) q[d] *= weights[d];
  std::vector<Neighbour> out;
  std::vector<float> row(q.size());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (!allowed.empty() && allowed[static_cast<std::size_t>(i)] == 0) continue;
    for (std::size_t d = 0; d < row.size(); ++d) {
      row[d] = rows(i, static_cast<Eigen::Index>(d)) * (weights.empty() ? 1.0F : weights[d]);
    }
    out.push_back({i, squared_distance_exact(row, q)});
  }
  std::ranges::stable_sort(out, {}, &Neighbour::squared);
  out.resize(std::min(out.size(), static_cast<std::size_t>(std::max(k, 0))));
  return out;
}

}  // namespace reference

}  // namespace kinespace
