// One frame, or one file, of each format: what mesh_files.h is made of.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/mesh/mesh_files.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct MeshFrame {
  std::vector<float> positions;
  std::vector<Triangle> triangles;
};

// Throw Error{bad_input} naming `name` and, for text, the line. Indices are checked, coordinates finite.
[[nodiscard]] MeshFrame parse_obj(std::string_view text, const std::string& name, const Progress& progress = {});
[[nodiscard]] MeshFrame parse_ply(std::string_view bytes, const std::string& name, const Progress& progress = {});
[[nodiscard]] MeshSequence parse_numpy(std::string_view positions, const std::string& positions_name,
                                       std::string_view triangles, const std::string& triangles_name);
[[nodiscard]] MeshSequence parse_gltf_mesh(std::string_view bytes, const std::filesystem::path& file,
                                           const MeshReadOptions& options = {});

[[nodiscard]] std::string format_obj(std::span<const float> positions, std::span<const Triangle> triangles);
[[nodiscard]] std::string format_ply(std::span<const float> positions, std::span<const Triangle> triangles);
[[nodiscard]] std::string format_numpy_positions(const MeshSequence& mesh);
[[nodiscard]] std::string format_numpy_triangles(std::span<const Triangle> triangles);
[[nodiscard]] std::string format_gltf_mesh(const MeshSequence& mesh, bool binary);

}  // namespace kinespace
