// Small meshes whose properties are known.
#pragma once

#include <filesystem>
#include <optional>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace::test {

// The corner of a cube: (0,0,0), (1,0,0), (0,1,0), (0,0,1), faces outwards.
[[nodiscard]] MeshSequence tetrahedron();
// A wavy sheet of columns x rows vertices at unit distance, in `frames` phases of the wave. Open boundary.
[[nodiscard]] MeshSequence sheet(int columns, int rows, int frames);
// A closed tube with rounded ends along x, of about `vertices` vertices, that bends more from frame to frame by up to
// `bend` radians in all, with fine bumps.
[[nodiscard]] MeshSequence bending_tube(int vertices, int frames, double bend);
// The meshes side by side, as one with several components. They must have the same number of frames.
[[nodiscard]] MeshSequence joined(const MeshSequence& a, const MeshSequence& b);
// Every frame turned about an axis and moved, differently in each.
[[nodiscard]] MeshSequence moved_rigidly(const MeshSequence& mesh, double angle_per_frame);

// The mesh sequences of the shared data; nullopt where they are not.
[[nodiscard]] std::optional<std::filesystem::path> mesh_folder();

}  // namespace kinespace::test
