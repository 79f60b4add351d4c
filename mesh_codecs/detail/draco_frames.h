// mesh-draco: each frame by itself with Draco, on one grid; to compare with.
//
//   setup        layout and grid
//   order        the order of vertices (key_mesh.h), that of the first frame
//   f0, f1, ..   each frame's surface; o1, ..: its order where it is another
#pragma once

#include <memory>

#include "kinespace/mesh_codecs/mesh_codec.h"

namespace kinespace {

[[nodiscard]] Bytes encode_draco_frames(const MeshSequence& mesh, const MeshCodecOptions& options);
[[nodiscard]] std::unique_ptr<MeshStreamReader> open_draco_frames(Bitstream stream);

}  // namespace kinespace
