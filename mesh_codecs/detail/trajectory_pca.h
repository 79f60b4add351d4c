// mesh-pca: principal components of the vertices' paths (CoDDyAC, vasa and skala 2007), to compare with.
//
// A vertex's path is a vector of 3 * frames numbers; a few orthonormal paths span nearly all. Each vertex has a weight
// for each of them, in steps, predicted from vertices that are known by parallelograms over the edges between (or by
// the mean of known neighbours), closed loop; the misses go through the range coder. Connectivity by Draco, without
// shape. Long sequences are cut into blocks of frames.
#pragma once

#include <memory>

#include "kinespace/mesh_codecs/mesh_codec.h"

namespace kinespace {

[[nodiscard]] Bytes encode_trajectory_pca(const MeshSequence& mesh, const MeshCodecOptions& options);
[[nodiscard]] std::unique_ptr<MeshStreamReader> open_trajectory_pca(Bitstream stream);

}  // namespace kinespace
