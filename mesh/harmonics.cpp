#include "kinespace/mesh/harmonics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/detail/eigenpairs.h"
#include "kinespace/mesh/laplacian.h"

namespace kinespace {
namespace {

[[noreturn]] void fail_usage(const char* field, const std::string& value, const std::string& range) {
  throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value), .expected = range});
}

// M^-1/2 S M^-1/2: the symmetric problem with the same eigenvalues.
SparseMatrix scaled(const SparseMatrix& stiffness, const Eigen::VectorXd& mass) {
  const Eigen::VectorXd root = mass.cwiseSqrt().cwiseInverse();
  return root.asDiagonal() * stiffness * root.asDiagonal();
}

// The smoothest pairs of one connected component, found again in larger numbers when more of them are wanted.
class ComponentPairs {
 public:
  ComponentPairs(const SparseMatrix& problem, std::vector<int> vertices, double tolerance)
      : vertices_(std::move(vertices)), matrix_(restricted(problem, vertices_)), tolerance_(tolerance) {}

  [[nodiscard]] int most() const { return static_cast<int>(vertices_.size()); }
  [[nodiscard]] int count() const { return static_cast<int>(pairs_.values.size()); }
  [[nodiscard]] double value(int k) const { return pairs_.values[k]; }

  void find(int wanted) {
    wanted = std::clamp(wanted, 1, most());
    if (count() >= wanted) return;
    constexpr int small = 600;
    const bool dense = most() <= small || wanted > most() / 2;
    pairs_ = dense ? smallest_eigenpairs_dense(matrix_, wanted) : smallest_eigenpairs(matrix_, wanted, tolerance_);
  }
  void copy_to(Eigen::Ref<Eigen::VectorXd> function, int k) const {
    function.setZero();
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      function[vertices_[i]] = pairs_.vectors(static_cast<Eigen::Index>(i), k);
    }
  }

 private:
  static SparseMatrix restricted(const SparseMatrix& problem, const std::vector<int>& vertices) {
    const auto size = static_cast<Eigen::Index>(vertices.size());
    if (size == problem.rows()) return problem;
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index j = 0; j < size; ++j) {
      for (SparseMatrix::InnerIterator it(problem, vertices[static_cast<std::size_t>(j)]); it; ++it) {
        const auto at = std::lower_bound(vertices.begin(), vertices.end(), static_cast<int>(it.row()));
        entries.emplace_back(static_cast<int>(at - vertices.begin()), static_cast<int>(j), it.value());
      }
    }
    SparseMatrix out(size, size);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  std::vector<int> vertices_;  // ascending
  SparseMatrix matrix_;
  double tolerance_;
  Eigenpairs pairs_;
};

// Component by component: one Lanczos process cannot be trusted to find an eigenvalue as often as it occurs, and zero
// occurs once for each.
class SmoothestPairs {
 public:
  SmoothestPairs(const SparseMatrix& problem, const Components& components, double tolerance) {
    std::vector<std::vector<int>> vertices(static_cast<std::size_t>(components.count));
    for (std::size_t v = 0; v < components.of.size(); ++v) {
      vertices[static_cast<std::size_t>(components.of[v])].push_back(static_cast<int>(v));
    }
    for (auto& of_one : vertices) parts_.emplace_back(problem, std::move(of_one), tolerance);
  }

  [[nodiscard]] Eigenpairs find(int count) {
    const auto all = static_cast<double>(std::accumulate(
        parts_.begin(), parts_.end(), 0, [](int sum, const ComponentPairs& part) { return sum + part.most(); }));
    for (ComponentPairs& part : parts_) {
      const double share = parts_.size() == 1 ? count : 1.2 * count * part.most() / all + 4;
      part.find(static_cast<int>(std::min<double>(share, count)));
    }
    for (;;) {
      const std::vector<Choice> chosen = smoothest(count);
      bool enough = static_cast<int>(chosen.size()) == count;
      for (std::size_t p = 0; p < parts_.size(); ++p) {
        const auto last = std::find_if(chosen.begin(), chosen.end(),
                                       [&](const Choice& c) { return c.part == p && c.k + 1 == parts_[p].count(); });
        const bool used_up = last != chosen.end() && parts_[p].count() < std::min(parts_[p].most(), count);
        if (!used_up) continue;
        parts_[p].find(std::min(parts_[p].count() * 2, count));
        enough = false;
      }
      if (enough) return gathered(chosen, static_cast<Eigen::Index>(all));
    }
  }

 private:
  struct Choice {
    double value;
    std::size_t part;
    int k;
  };

  [[nodiscard]] std::vector<Choice> smoothest(int count) const {
    std::vector<Choice> all;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      for (int k = 0; k < parts_[p].count(); ++k) all.push_back({std::max(parts_[p].value(k), 0.0), p, k});
    }
    std::stable_sort(all.begin(), all.end(), [](const Choice& a, const Choice& b) { return a.value < b.value; });
    if (all.size() > static_cast<std::size_t>(count)) all.resize(static_cast<std::size_t>(count));
    return all;
  }

  [[nodiscard]] Eigenpairs gathered(const std::vector<Choice>& chosen, Eigen::Index vertices) const {
    Eigenpairs out{Eigen::MatrixXd(vertices, static_cast<Eigen::Index>(chosen.size())),
                   Eigen::VectorXd(static_cast<Eigen::Index>(chosen.size()))};
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      parts_[chosen[i].part].copy_to(out.vectors.col(column), chosen[i].k);
      out.values[column] = chosen[i].value;
    }
    return out;
  }

  std::vector<ComponentPairs> parts_;
};

void make_sign_canonical(Eigen::Ref<Eigen::VectorXd> function) {
  const double largest = function.cwiseAbs().maxCoeff();
  for (const double x : function) {
    if (std::abs(x) < largest * (1 - 1e-6)) continue;
    if (x < 0) function = -function;
    return;
  }
}

}  // namespace

void HarmonicsOptions::validate(int vertices) const {
  if (functions < 1 || functions > vertices) {
    fail_usage("functions", std::to_string(functions), fmt::format("1 to {}, the number of vertices", vertices));
  }
  if (!(tolerance >= 1e-14 && tolerance <= 1e-2))
    fail_usage("tolerance", fmt::format("{}", tolerance), "1e-14 to 1e-2");
}

Harmonics manifold_harmonics(const Points& points, std::span<const Triangle> triangles,
                             const HarmonicsOptions& options) {
  const int vertices = static_cast<int>(points.rows());
  options.validate(vertices);
  const SparseMatrix stiffness = cotangent_stiffness(points, triangles);
  Harmonics out;
  out.mass = options.area_weighted ? lumped_mass(points, triangles) : Eigen::VectorXd(Eigen::VectorXd::Ones(vertices));
  const Components components = connected_components(Neighbours(vertices, triangles));
  SmoothestPairs solver(options.area_weighted ? scaled(stiffness, out.mass) : stiffness, components, options.tolerance);
  Eigenpairs pairs = solver.find(options.functions);
  out.eigenvalues = std::move(pairs.values);
  out.functions = std::move(pairs.vectors);
  if (options.area_weighted) out.functions = out.mass.cwiseSqrt().cwiseInverse().asDiagonal() * out.functions;
  for (Eigen::Index k = 0; k < out.functions.cols(); ++k) make_sign_canonical(out.functions.col(k));
  return out;
}

std::uint64_t basis_checksum(const Eigen::MatrixXd& functions) {
  const auto numbers = std::as_bytes(std::span(functions.data(), static_cast<std::size_t>(functions.size())));
  const std::array<std::uint64_t, 3> parts = {checksum64(numbers), static_cast<std::uint64_t>(functions.rows()),
                                              static_cast<std::uint64_t>(functions.cols())};
  return checksum64(std::as_bytes(std::span(parts)));
}

}  // namespace kinespace
