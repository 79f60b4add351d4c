// The bytes behind a glTF file's buffers: in the file, or in files beside it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/file.h"
#include "kinespace/gltf/budget.h"

namespace kinespace::gltf {

// Reads what the URIs of one file name. A data: URI is decoded; a relative reference (percent-encoded where need be)
// is a file in the folder of the .gltf file or below it. Nothing else is ever opened: not an absolute path, not a way
// up, not a link that leads out of the folder, not a URL.
class BufferSource {
 public:
  // `file`: the .gltf or .glb file. Nothing need be there while no buffer is a file of its own.
  BufferSource(std::filesystem::path file, Budget& budget) : file_(std::move(file)), budget_(budget) {}

  // The first `length` bytes. A file that was not read before counts as input. Throws Error{bad_input} when there are
  // fewer, or what the URI names is not to be had.
  [[nodiscard]] std::vector<unsigned char> read(const std::string& uri, std::uint64_t length);

 private:
  [[nodiscard]] std::vector<unsigned char> decoded(std::string_view uri, std::uint64_t length) const;
  [[nodiscard]] std::filesystem::path beside(const std::string& uri) const;
  [[nodiscard]] const FileContent& content_of(std::filesystem::path path);
  [[noreturn]] void fail(std::string found, std::string expected, std::string remedy = {}) const;

  std::filesystem::path file_;
  Budget& budget_;
  std::vector<std::filesystem::path> known_;  // counted already
  std::optional<FileContent> last_;           // of last_path_: buffers of one file come together
  std::filesystem::path last_path_;
};

}  // namespace kinespace::gltf
