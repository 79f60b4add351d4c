// Whole files in, whole files out.
//
// Reading checks the size before it allocates. Writing goes to a temporary file beside the target, is flushed to the
// disk (fsync) and then renamed over it, so a reader sees the old file or the new one, never half of either; a full
// disk or a killed process leaves the old file as it was. A link stays a link to the file it names, a file that was
// there keeps its permissions, and a device (/dev/null, a pipe) is written to as it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace kinespace {

// A read-only view of a file's bytes (memory-mapped; empty files give an empty view).
class MappedFile {
 public:
  // Throws Error (bad_input when the file is missing or not a regular file, machine when it cannot be mapped).
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  [[nodiscard]] std::string_view text() const noexcept { return {data_, size_}; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::as_bytes(std::span<const char>(data_, size_));
  }

 private:
  const char* data_ = nullptr;
  std::size_t size_ = 0;
};

// Replaces `path` by `content` in one step. Throws Error{machine} when that fails; then `path` is unchanged.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);

// Throws Error{usage} when `output` names the same existing file as `input`, by whatever path or link.
void require_different_files(const std::filesystem::path& input, const std::filesystem::path& output);

// 128-bit XXH3 of the bytes, as 32 hexadecimal digits: the identity of a source file, not a cryptographic promise.
[[nodiscard]] std::string content_hash(std::span<const std::byte> bytes);

// 64-bit XXH3 of the bytes: the checksum of the sections of a bitstream.
[[nodiscard]] std::uint64_t checksum64(std::span<const std::byte> bytes);

}  // namespace kinespace
