// Which point is which vertex: a permutation of what a mesh coder gives back in an order of its own.
//
// Vertices of files lie where their neighbours lie, more or less. So the point of the next vertex is sought among the
// neighbours of the latest vertices' points that are still free, nearest first, and its place in that list is coded; a
// point that is not in the list is coded by its number.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/entropy/integer_coder.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

// `point_of`: the point of each vertex, each once; as many points as vertices. `triangles` are of points.
// Returns how many neighbours were looked at, which is what it costs: at most 25 times those there are.
std::int64_t put_order(IntegerWriter& out, std::span<const std::int32_t> point_of, std::span<const Triangle> triangles);
// Throws Error{bad_input}.
[[nodiscard]] std::vector<std::int32_t> get_order(IntegerReader& in, int vertices, std::span<const Triangle> triangles);

}  // namespace kinespace
