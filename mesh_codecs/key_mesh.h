// Key-frames: triangles and one or more positions of every vertex, by Draco (edgebreaker, valences, parallelograms).
//
// Positions are whole numbers already (mesh coordinates over a step), since Draco's own quantiser knows powers of two
// of the box only. Several key-frames share one connectivity. What Draco drops or splits (vertices without triangles,
// degenerate triangles, vertices where surfaces touch) is put right by a second part, which also says in which order
// the vertices were. Where Draco cannot code a mesh at all, triangles and positions are coded one by one.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

using GridPoint = std::array<std::int32_t, 3>;

struct KeyMesh {
  int vertices = 0;
  std::vector<Triangle> triangles;
  std::vector<std::vector<GridPoint>> keys;  // of each key-frame, by vertex; 0 to 2^28
};

struct PackedKeyMesh {
  Bytes surface;  // Draco's; empty where it cannot
  Bytes order;    // and corrections
};

// Triangles come back as canonical_triangles (mesh/connectivity.h) has them.
[[nodiscard]] PackedKeyMesh pack_key_mesh(const KeyMesh& mesh);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] KeyMesh unpack_key_mesh(std::span<const std::byte> surface, std::span<const std::byte> order,
                                      int vertices, std::int64_t triangles, int keys, const std::string& source);

// What connectivity and order alone take: the packed bytes of the same mesh without shape.
[[nodiscard]] std::int64_t connectivity_size(const KeyMesh& mesh);

}  // namespace kinespace
