// The motion of the whole mesh, frame by frame: quaternion and translation on a fine grid, predicted to go on as in the
// two frames before (chen2019 section 3.1.1).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/rigid.h"

namespace kinespace {

// What the decoder will have, from motions; `size`: of the mesh, in its unit, that the grid of translations is a
// 2^-15 of.
struct RigidTrack {
  std::vector<std::array<std::int32_t, 6>> steps;  // x, y, z of the quaternion in 2^-14; translation
  double size = 0;

  [[nodiscard]] RigidMotion motion(std::size_t frame) const;
};
[[nodiscard]] RigidTrack quantised(std::span<const RigidMotion> motions, double size);

[[nodiscard]] Bytes pack_track(const RigidTrack& track);
// Throws Error{bad_input}.
[[nodiscard]] RigidTrack unpack_track(std::span<const std::byte> bytes, int frames, double size,
                                      const std::string& source);

}  // namespace kinespace
