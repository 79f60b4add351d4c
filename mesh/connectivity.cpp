#include "kinespace/mesh/connectivity.h"

#include <algorithm>

namespace kinespace {

Neighbours::Neighbours(int vertices, std::span<const Triangle> triangles)
    : first_(static_cast<std::size_t>(vertices) + 1) {
  std::vector<std::uint64_t> edges;  // both ways, from the vertex in the high half
  edges.reserve(triangles.size() * 6);
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint32_t>(t[k]), b = static_cast<std::uint32_t>(t[(k + 1) % 3]);
      if (a == b) continue;
      edges.push_back(std::uint64_t{a} << 32 | b);
      edges.push_back(std::uint64_t{b} << 32 | a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  vertex_.reserve(edges.size());
  for (const std::uint64_t edge : edges) {
    ++first_[(edge >> 32) + 1];
    vertex_.push_back(static_cast<std::int32_t>(edge & 0xffffffffU));
  }
  for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
}

Components connected_components(const Neighbours& neighbours) {
  Components out;
  out.of.assign(static_cast<std::size_t>(neighbours.vertices()), -1);
  std::vector<std::int32_t> open;
  for (std::int32_t v = 0; v < neighbours.vertices(); ++v) {
    if (out.of[static_cast<std::size_t>(v)] >= 0) continue;
    out.first_vertex.push_back(v);
    out.of[static_cast<std::size_t>(v)] = out.count;
    open.assign(1, v);
    while (!open.empty()) {
      const std::int32_t at = open.back();
      open.pop_back();
      for (const std::int32_t next : neighbours.of(at)) {
        auto& component = out.of[static_cast<std::size_t>(next)];
        if (component >= 0) continue;
        component = out.count;
        open.push_back(next);
      }
    }
    ++out.count;
  }
  return out;
}

std::vector<Triangle> canonical_triangles(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) t = std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace kinespace
