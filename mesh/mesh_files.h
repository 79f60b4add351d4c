// Mesh sequences in and out.
//
//   NumPy  a folder with positions.npy ([frames][vertices][3], or [vertices][3] for one frame; float32 or float64,
//          which is rounded to float32) and triangles.npy ([triangles][3]; int32, int64, uint32 or uint64); or that
//          positions file, whatever its name, with triangles.npy beside it. Little-endian, in C order.
//   OBJ    a folder with a file for each frame, in the natural order of their names (f2 before f10), or one file. `v`
//          and `f` are read, polygons are cut into fans; the rest is ignored.
//   PLY    the same, binary of either byte order: vertices with x, y, z; faces with vertex_indices or vertex_index.
//   glTF   .gltf or .glb, baked: nodes, skins and morph targets of one animation (or the rest pose, one frame) for
//          every node with triangles in the default scene, at `rate_hz`; where all samplers share evenly spaced times, at
//          those. Written as one mesh with a morph target a frame. Buffers in the file or in files of its folder
//          (gltf/detail/buffers.h); pictures are not looked at. Views packed by meshopt are unpacked; not read: files
//          that require Draco or another extension that changes shapes.
//
// The rate of what does not tell one is MeshSequence::usual_rate_hz. Every frame must have the vertices and triangles
// of the first, in the same order: another count or order is an Error{bad_input} that names file and frame. Sizes are
// checked against the bytes that are there before memory is taken; positions are held once.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "kinespace/base/progress.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

enum class MeshFormat : std::uint8_t {
  numpy,  // a folder
  obj,    // a folder, frame_00001.obj and so on
  ply,    // a folder, frame_00001.ply and so on, binary little-endian
  gltf,   // a file: .glb, else text
};

struct MeshReadOptions {
  // Frames a second, above 0 and at most 1e6: of files without a rate, and of the baking of a glTF animation.
  std::optional<double> rate_hz;
  // Bytes that may be made from one glTF file, all together. By default 64 times the file and 256 MiB, so that a small
  // file cannot fill the memory; long animations of large skinned meshes need more.
  std::optional<std::uint64_t> most_bytes;
  // Of a glTF file with several: by name, or by number from 1; the first when empty.
  std::string animation;
  // Told what was chosen where there is a choice.
  std::function<void(const std::string& what)> note;
  Progress progress;

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// Throws Error{bad_input}; Interrupted when options.progress says so.
[[nodiscard]] MeshSequence read_mesh_sequence(const std::filesystem::path& path, const MeshReadOptions& options = {});
[[nodiscard]] MeshSequence read_numpy_mesh(const std::filesystem::path& positions,
                                           const std::filesystem::path& triangles, std::optional<double> rate_hz = {});

// Whole or not at all. A folder is made with its content under another name and renamed; one that exists must be empty
// or hold, for NumPy, files of the two names only, which are replaced. Throws Error: machine when it cannot be written,
// usage when the folder holds something else, bad_input when the mesh is not valid or a glTF file of it would be above
// 2 GB.
void write_mesh_sequence(const std::filesystem::path& path, const MeshSequence& mesh,
                         MeshFormat format = MeshFormat::numpy, const Progress& progress = {});

// True for what read_mesh_sequence would try: a folder, .npy, .obj, .ply, .gltf, .glb.
[[nodiscard]] bool may_be_mesh_sequence(const std::filesystem::path& path);

}  // namespace kinespace
