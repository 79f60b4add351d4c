// The table of file formats. What is read and written, every ending in help and in messages, and what may stand in place of
// what come from it: a format of clips is a reader, a writer and one row.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/file_kind.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

namespace kinespace {

struct FileFormat {
  // options.companion is there when the format has one.
  using ReadClips = std::vector<Clip> (*)(const std::filesystem::path& path, const ClipReadOptions& options,
                                          ClipsWanted wanted);
  using ListClips = std::vector<std::string> (*)(const std::filesystem::path& path);
  using WriteClip = void (*)(const std::filesystem::path& path, const Clip& clip);

  std::string_view ending;  // with its dot, in small letters
  FileKind kind = FileKind::other;
  ReadClips read = nullptr;
  ListClips list = nullptr;         // the names of a file's clips; null: a file is one clip
  WriteClip write = nullptr;        // with its companion
  bool holds_meshes = false;        // read by mesh/mesh_files.h
  std::string_view companion = {};  // the file it goes with: an ending, or a name in the same folder
  // Where a clip was wanted and this is no file to read: what it is, and what to do.
  std::string_view instead = {};
  std::string_view remedy = {};
};

[[nodiscard]] std::span<const FileFormat> file_formats();
// By the ending of a path, in capitals or not; nullptr when there is none.
[[nodiscard]] const FileFormat* find_format(const std::filesystem::path& path);

// The endings of clips that are read and written, of meshes that are read, in the order of the table.
[[nodiscard]] std::vector<std::string> clip_endings_read();
[[nodiscard]] std::vector<std::string> clip_endings_written();
[[nodiscard]] std::vector<std::string> mesh_endings();
// ".a, .b or .c".
[[nodiscard]] std::string listed(std::span<const std::string> endings);

}  // namespace kinespace
