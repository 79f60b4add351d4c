// How a VectorSearch is made: rows turned, gathered in blocks, and what bounds them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/symmetric_eigen.h"
#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/projection.h"
#include "kinespace/synthesis/vector_search.h"

namespace kinespace {
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
