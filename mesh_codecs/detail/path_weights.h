// Whole numbers on the vertices of a mesh, each predicted from known ones nearby (mesh-pca).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

// The order in which vertices are coded, and from what each is predicted: made by both sides from the triangles.
class VertexWalk {
 public:
  VertexWalk(int vertices, std::span<const Triangle> triangles);

  [[nodiscard]] std::span<const std::int32_t> order() const { return order_; }
  // From the values of vertices earlier in the order.
  [[nodiscard]] std::int64_t expected(std::int32_t vertex, std::span<const std::int64_t> values) const;

 private:
  struct Source {
    std::int32_t plus, other, minus;  // plus + other - minus; plus alone where minus < 0
  };
  std::vector<std::int32_t> order_;
  std::vector<std::int64_t> first_;
  std::vector<Source> sources_;
};

[[nodiscard]] Bytes pack_weights(std::span<const std::int64_t> values, int components, const VertexWalk& walk);
// [component][vertex]. Throws Error{bad_input}.
[[nodiscard]] std::vector<std::int64_t> unpack_weights(std::span<const std::byte> bytes, int components, int vertices,
                                                       const VertexWalk& walk, const std::string& source);

}  // namespace kinespace
