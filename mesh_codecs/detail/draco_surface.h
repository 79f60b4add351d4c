// Draco behind an interface without its types: triangles with whole-number attributes at their corners' points.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh_codecs/key_mesh.h"

namespace kinespace {

struct Surface {
  int points = 0;
  std::vector<Triangle> triangles;
  std::vector<std::vector<GridPoint>> keys;  // by point
  std::vector<std::int32_t> label;           // by point; empty: none
};

// None when Draco cannot code it.
[[nodiscard]] std::optional<Bytes> draco_encode(const Surface& surface);

// At most so many points and triangles are allowed, checked before memory is taken. Throws Error{bad_input} naming
// `source`; so it does for another number of attributes. `labelled`: the last attribute is the label.
[[nodiscard]] Surface draco_decode(std::span<const std::byte> bytes, int most_points, std::int64_t most_triangles,
                                   int keys, bool labelled, const std::string& source);

}  // namespace kinespace
