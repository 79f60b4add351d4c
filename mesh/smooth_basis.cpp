#include "kinespace/mesh/smooth_basis.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/detail/dense_kernels.h"
#include "kinespace/mesh/laplacian.h"
#include "kinespace/mesh/sparse_solver.h"
#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

constexpr std::int32_t far_away = 1000;  // hops from no anchor at all
constexpr double regularisation = 1e-6;  // e, in mean diagonals of S

// S + e I. Sums are written out: a library's mean adds up in an order of its own.
SparseMatrix regularised(SparseMatrix stiffness) {
  double trace = 0;
  for (Eigen::Index v = 0; v < stiffness.rows(); ++v) trace += stiffness.coeff(v, v);
  const double mean = trace / static_cast<double>(stiffness.rows());
  for (Eigen::Index v = 0; v < stiffness.rows(); ++v) {
    stiffness.coeffRef(v, v) += regularisation * (mean > 0 ? mean : 1);
  }
  return stiffness;
}

// In eight sums side by side, whose order is the same on every machine.
KINESPACE_VECTOR_CLONES
double dot(const double* a, const double* b, std::ptrdiff_t count) {
  constexpr int lanes = 8;
  double sum[lanes] = {};
  std::ptrdiff_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (int l = 0; l < lanes; ++l) sum[l] += a[i + l] * b[i + l];
  }
  double all = 0;
  for (const double part : sum) all += part;
  for (; i < count; ++i) all += a[i] * b[i];
  return all;
}

KINESPACE_VECTOR_CLONES
void subtract_multiple(double weight, const double* a, double* b, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) b[i] -= weight * a[i];
}

// Grows an orthonormal basis by blocks of functions around new anchors.
class Builder {
 public:
  Builder(const Points& points, std::span<const Triangle> triangles, const SmoothBasisOptions& options)
      : vertices_(points.rows()),
        functions_(options.functions),
        order_(options.order),
        neighbours_(static_cast<int>(points.rows()), triangles),
        components_(connected_components(neighbours_)),
        solver_(regularised(cotangent_stiffness(points, triangles))),
        basis_(static_cast<std::size_t>(vertices_ * functions_)),
        residual_(static_cast<std::size_t>(vertices_ * 3)),
        hops_(static_cast<std::size_t>(vertices_), far_away) {
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      for (Eigen::Index c = 0; c < 3; ++c) residual_[static_cast<std::size_t>(3 * v + c)] = points(v, c);
    }
  }

  SmoothBasis build() && {
    add_constants();
    const int step = 8 * ((functions_ + 255) / 256);
    while (count_ < functions_) add_functions(choose(std::min(step, functions_ - count_)));
    SmoothBasis out;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    out.functions = Eigen::Map<const RowMajor>(basis_.data(), vertices_, functions_);
    out.anchors = std::move(anchors_);
    return out;
  }

 private:
  [[nodiscard]] Rows columns_from(int k) { return {basis_.data() + k, functions_}; }
  [[nodiscard]] ConstRows found() const { return {basis_.data(), functions_}; }

  void add_constants() {
    std::vector<std::int64_t> size(static_cast<std::size_t>(components_.count));
    for (const std::int32_t c : components_.of) ++size[static_cast<std::size_t>(c)];
    std::vector<std::size_t> largest(size.size());
    std::iota(largest.begin(), largest.end(), std::size_t{0});
    std::stable_sort(largest.begin(), largest.end(), [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
    largest.resize(std::min(largest.size(), static_cast<std::size_t>(functions_)));
    std::vector<int> column(size.size(), -1);
    for (std::size_t i = 0; i < largest.size(); ++i) column[largest[i]] = static_cast<int>(i);
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      const auto c = static_cast<std::size_t>(components_.of[static_cast<std::size_t>(v)]);
      if (column[c] >= 0) columns_from(column[c]).data[v * functions_] = 1 / std::sqrt(static_cast<double>(size[c]));
    }
    take_into_basis(static_cast<int>(largest.size()));
  }

  // The next `columns` of the basis are done: what they hold of the mesh leaves the residual.
  void take_into_basis(int columns) {
    std::vector<double> held(static_cast<std::size_t>(columns) * 3);
    const ConstRows added{basis_.data() + count_, functions_};
    transposed_product(vertices_, columns, 3, added, {residual_.data(), 3}, {held.data(), 3});
    subtract_product(vertices_, columns, 3, added, {held.data(), 3}, {residual_.data(), 3});
    count_ += columns;
  }

  // One after the other the vertices with the largest r^2 h^3: r the distance from the projection, h the hops from the
  // anchors there are. r alone crowds them where this frame has folds, h alone spreads them evenly.
  [[nodiscard]] std::vector<std::int32_t> choose(int wanted) {
    std::vector<double> weight(static_cast<std::size_t>(vertices_));
    for (std::size_t v = 0; v < weight.size(); ++v) {
      const double* const r = residual_.data() + 3 * v;
      weight[v] = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    }
    std::vector<std::int32_t> out;
    while (static_cast<int>(out.size()) < wanted) {
      std::int32_t best = -1;
      double most = -1;
      for (std::size_t v = 0; v < weight.size(); ++v) {
        if (hops_[v] == 0) continue;
        const double hops = hops_[v];
        const double score = weight[v] * hops * hops * hops;
        if (score > most) {
          most = score;
          best = static_cast<std::int32_t>(v);
        }
      }
      out.push_back(best);
      walk_from(best);
    }
    return out;
  }

  // Lowers the hops of what is closer to a new anchor than to those before it.
  void walk_from(std::int32_t anchor) {
    hops_[static_cast<std::size_t>(anchor)] = 0;
    ring_.assign(1, anchor);
    for (std::int32_t hops = 1; !ring_.empty(); ++hops) {
      next_ring_.clear();
      for (const std::int32_t a : ring_) {
        for (const std::int32_t b : neighbours_.of(a)) {
          if (hops_[static_cast<std::size_t>(b)] <= hops) continue;
          hops_[static_cast<std::size_t>(b)] = hops;
          next_ring_.push_back(b);
        }
      }
      ring_.swap(next_ring_);
    }
  }

  void add_functions(const std::vector<std::int32_t>& anchors) {
    const int columns = static_cast<int>(anchors.size());
    block_.assign(static_cast<std::size_t>(vertices_ * columns), 0.0);
    for (int c = 0; c < columns; ++c) {
      block_[static_cast<std::size_t>(anchors[static_cast<std::size_t>(c)]) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>(c)] = 1;
    }
    for (int p = 0; p < order_; ++p) {
      remove_means(columns);
      solver_.solve(block_.data(), columns, scratch_);
    }
    remove_means(columns);
    turn_block(columns);
    for (int c = 0; c < columns; ++c) scale_to_unit(column(c));
    // What is left of smooth functions beside smoother ones is small: a second and a third pass clean its rounding.
    for (int pass = 0; pass < 3; ++pass) {
      turn_back(columns);
      orthogonalise_to_basis(block_.data(), columns);
      turn_block(columns);
      if (pass == 0) {
        for (int c = 0; c < columns; ++c) scale_to_unit(column(c));
      } else {
        for (int c = 0; c < columns; ++c) orthogonalise_in_block(c, anchors[static_cast<std::size_t>(c)]);
      }
    }
    turn_back(columns);
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      std::copy_n(block_.data() + v * columns, columns, basis_.data() + v * functions_ + count_);
    }
    take_into_basis(columns);
    anchors_.insert(anchors_.end(), anchors.begin(), anchors.end());
  }

  // Constants are in the basis already, and would swamp what else a solution holds.
  void remove_means(int columns) {
    std::vector<double> sum(static_cast<std::size_t>(components_.count * columns)), size(sum.size());
    const auto place = [&](Eigen::Index v, int c) {
      return static_cast<std::size_t>(components_.of[static_cast<std::size_t>(v)] * columns + c);
    };
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      for (int c = 0; c < columns; ++c) {
        sum[place(v, c)] += block_[static_cast<std::size_t>(v * columns + c)];
        size[place(v, c)] += 1;
      }
    }
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      for (int c = 0; c < columns; ++c) {
        block_[static_cast<std::size_t>(v * columns + c)] -= sum[place(v, c)] / size[place(v, c)];
      }
    }
  }

  // The block by columns, each in one piece, and back.
  void turn_block(int columns) {
    turned_.resize(block_.size());
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      for (int c = 0; c < columns; ++c) column(c)[v] = block_[static_cast<std::size_t>(v * columns + c)];
    }
  }
  void turn_back(int columns) {
    for (Eigen::Index v = 0; v < vertices_; ++v) {
      for (int c = 0; c < columns; ++c) block_[static_cast<std::size_t>(v * columns + c)] = column(c)[v];
    }
  }
  [[nodiscard]] double* column(int c) { return turned_.data() + c * vertices_; }

  // Returns the length before. A column of no length stays as it is.
  double scale_to_unit(double* column) {
    const double length = std::sqrt(dot(column, column, vertices_));
    if (length > 0) {
      for (Eigen::Index v = 0; v < vertices_; ++v) column[v] /= length;
    }
    return length;
  }

  // For columns stored by rows; one column is both.
  void orthogonalise_to_basis(double* block, int columns) {
    held_.resize(static_cast<std::size_t>(count_ * columns));
    transposed_product(vertices_, count_, columns, found(), {block, columns}, {held_.data(), columns});
    subtract_product(vertices_, count_, columns, found(), {held_.data(), columns}, {block, columns});
  }

  // Makes column c a unit vector orthogonal to the columns before it. What little is left of a column that depends on
  // the others is rounding: the unit impulse at its anchor, and then at other vertices, takes its place.
  void orthogonalise_in_block(int c, std::int32_t anchor) {
    constexpr double lost = 1e-6;
    subtract_earlier(c);
    bool good = scale_to_unit(column(c)) > lost;
    for (std::int32_t tried = 0; !good && tried < vertices_; ++tried) {
      std::fill_n(column(c), vertices_, 0.0);
      column(c)[(anchor + tried) % vertices_] = 1;
      for (int pass = 0; pass < 2; ++pass) {
        orthogonalise_to_basis(column(c), 1);
        subtract_earlier(c);
      }
      good = scale_to_unit(column(c)) > lost;
    }
    subtract_earlier(c);
    scale_to_unit(column(c));
  }

  void subtract_earlier(int c) {
    for (int b = 0; b < c; ++b)
      subtract_multiple(dot(column(b), column(c), vertices_), column(b), column(c), vertices_);
  }

  Eigen::Index vertices_;
  int functions_, order_, count_ = 0;
  Neighbours neighbours_;
  Components components_;
  SparseSolver solver_;
  std::vector<double> basis_;     // by rows
  std::vector<double> residual_;  // of the mesh, by rows
  std::vector<std::int32_t> hops_;
  std::vector<std::int32_t> ring_, next_ring_;
  std::vector<std::int32_t> anchors_;
  std::vector<double> block_, turned_, held_, scratch_;
};

}  // namespace

void SmoothBasisOptions::validate(int vertices) const {
  const auto fail = [](const char* field, int value, const std::string& range) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value), .expected = range});
  };
  if (functions < 1 || functions > vertices) {
    fail("functions", functions, fmt::format("1 to {}, the number of vertices", vertices));
  }
  if (order < 1 || order > 4) fail("order", order, "1 to 4");
}

SmoothBasis smooth_basis(const Points& points, std::span<const Triangle> triangles, const SmoothBasisOptions& options) {
  options.validate(static_cast<int>(points.rows()));
  return Builder(points, triangles, options).build();
}

}  // namespace kinespace
