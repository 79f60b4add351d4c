#include "kinespace/mesh/mesh_report.h"

#include <algorithm>
#include <vector>

#include <Eigen/Geometry>

#include "kinespace/mesh/connectivity.h"

namespace kinespace {
namespace {

// The triangles that make the surface: neither degenerate nor there before.
std::vector<Triangle> surface(const MeshSequence& mesh, MeshReport& out) {
  struct Key {
    Triangle sorted;
    std::size_t at;
  };
  std::vector<Key> keys;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (degenerate(mesh.triangles[t])) {
      ++out.degenerate_triangles;
      continue;
    }
    Triangle sorted = mesh.triangles[t];
    std::sort(sorted.begin(), sorted.end());
    keys.push_back({sorted, t});
  }
  std::sort(keys.begin(), keys.end(),
            [](const Key& a, const Key& b) { return a.sorted != b.sorted ? a.sorted < b.sorted : a.at < b.at; });
  std::vector<Triangle> kept;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0 && keys[i].sorted == keys[i - 1].sorted) {
      ++out.duplicate_triangles;
    } else {
      kept.push_back(mesh.triangles[keys[i].at]);
    }
  }
  return kept;
}

bool flat(const Points& points, const Triangle& t) {
  const Eigen::Vector3d a = points.row(t[0]), b = points.row(t[1]), c = points.row(t[2]);
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return (b - a).cross(c - a).norm() <= 1e-7 * longest;
}

std::int64_t flat_triangles(const MeshSequence& mesh, std::span<const Triangle> triangles) {
  std::vector<bool> seen(triangles.size());
  for (int f = 0; f < mesh.frames; ++f) {
    const Points points = frame_points(mesh, f);
    for (std::size_t t = 0; t < triangles.size(); ++t) seen[t] = seen[t] || flat(points, triangles[t]);
  }
  return std::count(seen.begin(), seen.end(), true);
}

// Edges, and what is odd about them.
void count_edges(int vertices, std::span<const Triangle> triangles, MeshReport& out) {
  struct Half {
    std::int32_t low, high;
    bool up;
  };
  std::vector<Half> halves;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = t[k], b = t[(k + 1) % 3];
      halves.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  const auto before = [](const Half& a, const Half& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; };
  std::sort(halves.begin(), halves.end(), before);
  std::vector<Triangle> boundary;  // its edges, as triangles with a vertex twice
  for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
    for (end = i; end < halves.size() && !before(halves[i], halves[end]);) ++end;
    ++out.edges;
    if (end - i == 1) {
      ++out.boundary_edges;
      boundary.push_back({halves[i].low, halves[i].high, halves[i].high});
    } else if (end - i > 2) {
      ++out.nonmanifold_edges;
    } else if (halves[i].up == halves[i + 1].up) {
      ++out.inconsistent_edges;
    }
  }
  const Neighbours along(vertices, boundary);
  const Components loops = connected_components(along);
  for (const std::int32_t v : loops.first_vertex) out.boundary_loops += along.of(v).empty() ? 0 : 1;
}

}  // namespace

MeshReport report(const MeshSequence& mesh) {
  MeshReport out;
  out.vertices = mesh.vertices;
  out.frames = mesh.frames;
  out.rate_hz = mesh.rate_hz;
  out.triangles = static_cast<std::int64_t>(mesh.triangles.size());
  out.diagonal = diagonal(mesh);
  const std::vector<Triangle> triangles = surface(mesh, out);
  out.flat_triangles = flat_triangles(mesh, triangles);
  count_edges(mesh.vertices, triangles, out);
  const Neighbours neighbours(mesh.vertices, mesh.triangles);
  const Components parts = connected_components(neighbours);
  std::vector<bool> used(static_cast<std::size_t>(mesh.vertices));
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) used[static_cast<std::size_t>(v)] = true;
  }
  out.isolated_vertices = std::count(used.begin(), used.end(), false);
  for (const std::int32_t v : parts.first_vertex) out.components += used[static_cast<std::size_t>(v)] ? 1 : 0;
  return out;
}

}  // namespace kinespace
