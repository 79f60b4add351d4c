// What a stream of a mesh sequence says about itself: its measured error.
#pragma once

#include <cstdint>
#include <functional>

#include "kinespace/base/progress.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

// The error of frames that a decoder gives, a few at a time; `rigidity`: with lr, which takes longer.
[[nodiscard]] MeshError measured(const MeshSequence& mesh, const std::function<Points(int)>& frame, bool rigidity,
                                 const Progress& progress);

// Options kg, kg_time, lr (each only where it is a number: nothing moves in a single frame) and connectivity (bytes).
void set_measured(BitstreamWriter& out, const MeshError& error, std::int64_t connectivity);

}  // namespace kinespace
