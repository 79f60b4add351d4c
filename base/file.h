// Whole files in, whole files out.
//
// Reading checks the size before it allocates. Writing goes to a temporary file beside the target, is flushed to the
// disk (fsync) and then renamed over it, so a reader sees the old file or the new one, never half of either; a full
// disk or a killed process leaves the old file as it was. A link stays a link to the file it names, a file that was
// there keeps its permissions, and a device (/dev/null, a pipe) is written to as it is.
//
// The one rule of what may be overwritten: a file is put over none, over an empty one or over one of its own kind
// (base/file_kind.h), never over another. That no command overwrites what it reads is held by cli/file_options.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "kinespace/base/file_kind.h"

namespace kinespace {

// A file read from its beginning to its end, piece by piece.
class FileReader {
 public:
  // Throws Error: bad_input when the file is missing, not a regular file, or changes its length while it is read;
  // machine when it cannot be read.
  explicit FileReader(std::filesystem::path path);
  ~FileReader();
  FileReader(FileReader&& other) noexcept;
  FileReader& operator=(FileReader&& other) = delete;
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t remaining() const noexcept { return size_ - at_; }
  // The next bytes: as many as there is room for, or all that are left. Returns how many.
  std::size_t read(std::span<char> room);

 private:
  std::filesystem::path path_;
  int fd_ = -1;
  std::size_t size_ = 0;
  std::size_t at_ = 0;
};

// The bytes of a file, in memory of their own: what happens to the file afterwards does not matter.
class FileContent {
 public:
  // Throws Error as FileReader does, and Error{machine} when there is no memory for the file.
  explicit FileContent(const std::filesystem::path& path);
  ~FileContent();
  FileContent(FileContent&& other) noexcept;
  FileContent& operator=(FileContent&& other) noexcept;
  FileContent(const FileContent&) = delete;
  FileContent& operator=(const FileContent&) = delete;

  [[nodiscard]] std::string_view text() const noexcept { return {data_, size_}; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::as_bytes(std::span<const char>(data_, size_));
  }

 private:
  FileContent() = default;

  char* data_ = nullptr;
  std::size_t size_ = 0;
};

// Replaces `path` by `content` in one step. Throws Error; then `path` is unchanged: machine when it cannot be written,
// usage when a file of another kind is there.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);

// Takes the next piece of a file that is written piece by piece.
using FileSink = std::function<void(std::string_view)>;

// Files that belong together, all or none: every one is complete and flushed before the first is put in its place, and
// when one cannot be, those before it are taken back.
struct FileToWrite {
  std::filesystem::path path;
  std::string_view content;                        // with enough of the beginning to tell its kind
  std::function<void(const FileSink&)> more = {};  // hands over what follows; none: nothing does
};
void write_files_atomically(std::span<const FileToWrite> files);

// Throws Error{usage} when a file stands there that one of that kind may not be put over. Every writer asks; ask before
// long work, too.
void require_replaceable(const std::filesystem::path& path, FileKind kind);

// Removes what killed processes left in a folder of what they were writing (.kinespace-PID-N...). Never fails.
void remove_leftovers(const std::filesystem::path& folder);

// Throws Error{usage} when `output` names the same existing file as `input`, by whatever path or link.
void require_different_files(const std::filesystem::path& input, const std::filesystem::path& output);

// 128-bit XXH3 of the bytes, as 32 hexadecimal digits: the identity of a source file, not a cryptographic promise.
[[nodiscard]] std::string content_hash(std::span<const std::byte> bytes);
// Of a file, read piece by piece. Throws Error as FileReader does.
[[nodiscard]] std::string hash_of_file(const std::filesystem::path& path);

// Its first bytes, file_kind_bytes or all. Throws Error as FileReader does.
[[nodiscard]] std::string start_of_file(const std::filesystem::path& path);

// 64-bit XXH3 of the bytes: the checksum of the sections of a bitstream.
[[nodiscard]] std::uint64_t checksum64(std::span<const std::byte> bytes);

}  // namespace kinespace
