// What kind of file bytes are, by how they begin: so that no writer puts one kind over another (base/file.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace kinespace {

enum class FileKind : std::uint8_t {
  empty,
  database,  // SQLite: a library, or somebody else's
  stream,    // the bitstream of every codec: .ksm
  bvh,
  asf,
  amc,
  glb,
  json,  // glTF text among it
  svg,
  png,
  html,
  numpy,
  obj,
  ply,
  other,
};

// Enough of a file's beginning to tell.
inline constexpr std::size_t file_kind_bytes = 4096;

// `start`: the whole file or its first file_kind_bytes.
[[nodiscard]] FileKind file_kind(std::span<const std::byte> start);

// For messages, with its article: "a PNG picture", "a file of no kind that is known here".
[[nodiscard]] std::string_view describe(FileKind kind);

}  // namespace kinespace
