// What the triangles of a mesh join: neighbours of vertices and connected components.
//
// Degenerate triangles (a vertex twice) join nothing by themselves beyond the edges they have; indices must be in
// range.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

// The vertices that share a triangle's edge with each vertex: its 1-ring, ascending, each once, without itself.
class Neighbours {
 public:
  Neighbours(int vertices, std::span<const Triangle> triangles);

  [[nodiscard]] int vertices() const { return static_cast<int>(first_.size()) - 1; }
  [[nodiscard]] std::span<const std::int32_t> of(int vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(vertex_).subspan(static_cast<std::size_t>(first_[v]),
                                      static_cast<std::size_t>(first_[v + 1] - first_[v]));
  }
  [[nodiscard]] std::size_t edges() const { return vertex_.size() / 2; }

 private:
  std::vector<std::int64_t> first_;
  std::vector<std::int32_t> vertex_;
};

// The component of every vertex, numbered by their lowest vertices. A vertex without triangles is one of its own.
struct Components {
  int count = 0;
  std::vector<std::int32_t> of;            // by vertex
  std::vector<std::int32_t> first_vertex;  // by component
};
[[nodiscard]] Components connected_components(const Neighbours& neighbours);

// Each triangle turned so that the least sequence of its vertices results (orientation kept), all in ascending order:
// equal for meshes that differ only in the order of their triangles.
[[nodiscard]] std::vector<Triangle> canonical_triangles(std::vector<Triangle> triangles);

}  // namespace kinespace
