#include "kinespace/mesh/laplacian.h"

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Geometry>

#include "kinespace/mesh/connectivity.h"

namespace kinespace {
namespace {

std::array<Eigen::Vector3d, 3> corners_of(const Points& points, const Triangle& t) {
  return {points.row(t[0]), points.row(t[1]), points.row(t[2])};
}

using Entries = std::vector<Eigen::Triplet<double>>;

void add_edge(Entries& entries, int i, int j, double weight) {
  entries.emplace_back(i, j, -weight);
  entries.emplace_back(j, i, -weight);
  entries.emplace_back(i, i, weight);
  entries.emplace_back(j, j, weight);
}

SparseMatrix assembled(int vertices, Entries& entries) {
  // A vertex without edges has its zero too: factorisations want the whole diagonal.
  for (int v = 0; v < vertices; ++v) entries.emplace_back(v, v, 0.0);
  SparseMatrix out(vertices, vertices);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace

SparseMatrix cotangent_stiffness(const Points& points, std::span<const Triangle> triangles, double flatness) {
  Entries entries;
  entries.reserve(triangles.size() * 12 + static_cast<std::size_t>(points.rows()));
  for (const Triangle& t : triangles) {
    if (degenerate(t)) continue;
    const auto p = corners_of(points, t);
    const double longest =
        std::max({(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()});
    const double doubled_area = std::max((p[1] - p[0]).cross(p[2] - p[0]).norm(), flatness * longest);
    if (!(doubled_area > 0)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      add_edge(entries, t[i], t[j], 0.5 * (p[i] - p[k]).dot(p[j] - p[k]) / doubled_area);
    }
  }
  return assembled(static_cast<int>(points.rows()), entries);
}

SparseMatrix uniform_stiffness(int vertices, std::span<const Triangle> triangles) {
  const Neighbours neighbours(vertices, triangles);
  Entries entries;
  entries.reserve(neighbours.edges() * 4 + static_cast<std::size_t>(vertices));
  for (int v = 0; v < vertices; ++v) {
    for (const std::int32_t other : neighbours.of(v)) {
      if (v < other) add_edge(entries, v, other, 1);
    }
  }
  return assembled(vertices, entries);
}

Eigen::VectorXd lumped_mass(const Points& points, std::span<const Triangle> triangles) {
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(points.rows());
  double total = 0;
  for (const Triangle& t : triangles) {
    if (degenerate(t)) continue;
    const auto p = corners_of(points, t);
    const double area = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
    for (const std::int32_t v : t) mass[v] += area / 3;
    total += area;
  }
  if (!(total > 0)) return Eigen::VectorXd::Ones(points.rows());
  const double least = 1e-6 * total / static_cast<double>(points.rows());
  for (Eigen::Index v = 0; v < mass.size(); ++v) mass[v] = std::max(mass[v], least);
  return mass;
}

}  // namespace kinespace
