// The files of a build: a locked one, and one file put in the place of another. Internal to storage/.
#pragma once

#include <filesystem>

namespace kinespace::build_files {

// A file, made when it is not there, that one process holds at a time (flock). Released at the end of its life, or when
// the process ends however it ends.
class LockedFile {
 public:
  // Throws Error{machine} when another process holds it, or it cannot be made. `shown` is what messages call it.
  LockedFile(std::filesystem::path path, const std::filesystem::path& shown);
  ~LockedFile();
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  // Makes it empty, so that a database can start over in it.
  void clear();
  // Takes it off the folder; the lock stays with whoever has it open.
  void remove();

 private:
  std::filesystem::path path_;
  std::filesystem::path shown_;
  int fd_ = -1;
};

// The path of SQLite's journal of a database.
[[nodiscard]] std::filesystem::path journal_of(const std::filesystem::path& database);

// Flushes `file` to the disk and renames it over `target`. Throws Error{machine}; then the target is unchanged.
void replace(const std::filesystem::path& target, const std::filesystem::path& file);

// Which state of a file this is: its place on the disk, size and time of change. Empty when it is not there.
[[nodiscard]] std::string identity_of(const std::filesystem::path& file);

}  // namespace kinespace::build_files
