// What a mesh sequence is like: sizes, and what a codec or a solver had better know about its connectivity.
//
// Nothing counted here is an error: every part of mesh/ takes such meshes, and says how.
#pragma once

#include <cstdint>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct MeshReport {
  int vertices = 0;
  int frames = 0;
  double rate_hz = 0;
  std::int64_t triangles = 0;
  std::int64_t edges = 0;
  double diagonal = 0;                    // of the box around all frames, in the file's unit
  std::int64_t degenerate_triangles = 0;  // a vertex twice
  std::int64_t flat_triangles = 0;        // not degenerate, but without area in some frame
  std::int64_t duplicate_triangles = 0;   // the same three vertices as an earlier triangle, in whatever order
  std::int64_t nonmanifold_edges = 0;     // in more than two triangles (duplicates counted once)
  std::int64_t inconsistent_edges = 0;    // in two triangles that do not look to the same side
  std::int64_t boundary_edges = 0;        // in one triangle only
  std::int64_t boundary_loops = 0;        // connected parts of the boundary
  std::int64_t isolated_vertices = 0;     // in no triangle
  std::int64_t components = 0;            // connected parts, isolated vertices not counted
  [[nodiscard]] bool watertight() const { return triangles > 0 && boundary_edges == 0 && nonmanifold_edges == 0; }
};

// A triangle without area: twice its area is below 1e-7 of its longest edge squared (what 32-bit floats can tell).
[[nodiscard]] MeshReport report(const MeshSequence& mesh);

}  // namespace kinespace
