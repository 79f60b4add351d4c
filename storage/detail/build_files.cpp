#include "kinespace/storage/detail/build_files.h"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "kinespace/base/error.h"

namespace kinespace::build_files {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what, int code, std::string remedy) {
  throw Error(ErrorKind::machine, {.file = path.string(),
                                   .found = what + ": " + std::generic_category().message(code),
                                   .remedy = std::move(remedy)});
}

bool same_file(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

void sync_folder(const std::filesystem::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);  // a file system that cannot sync a folder has done what it can
  ::close(fd);
}

}  // namespace

LockedFile::LockedFile(std::filesystem::path path, const std::filesystem::path& shown)
    : path_(std::move(path)), shown_(shown) {
  for (;;) {
    fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd_ < 0) {
      fail(shown_, "cannot write beside it", errno, "check that the folder exists and that it is yours to write");
    }
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      const int code = errno;
      ::close(fd_);
      if (code != EWOULDBLOCK) fail(shown_, "cannot lock " + path_.string(), code, "choose another place");
      throw Error(ErrorKind::machine, {.file = shown_.string(),
                                       .found = "another process is building this library",
                                       .remedy = "wait until it has ended, or give another name"});
    }
    // Its holder may have removed it between our open and its release: then what we hold has no name any more.
    struct stat ours {};
    struct stat named {};
    if (::fstat(fd_, &ours) == 0 && ::stat(path_.c_str(), &named) == 0 && same_file(ours, named)) return;
    ::close(fd_);
  }
}

LockedFile::~LockedFile() {
  ::close(fd_);
}

void LockedFile::clear() {
  // In this order: a journal beside an empty database is dropped by SQLite, a torn database without one is not noticed.
  if (::ftruncate(fd_, 0) != 0) fail(shown_, "cannot clear " + path_.string(), errno, "remove that file");
  ::unlink(journal_of(path_).c_str());
}

void LockedFile::remove() {
  ::unlink(path_.c_str());
}

std::filesystem::path journal_of(const std::filesystem::path& database) {
  return database.string() + "-journal";
}

void replace(const std::filesystem::path& target, const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) fail(target, "cannot open " + file.string(), errno, "build it again");
  const bool flushed = ::fsync(fd) == 0;
  const int code = errno;
  ::close(fd);
  if (!flushed) fail(target, "cannot flush", code, "free some space or choose another place");
  if (::rename(file.c_str(), target.c_str()) != 0) {
    fail(target, "cannot replace the file", errno, "check that it is a file and yours to write");
  }
  sync_folder(target.parent_path());
}

std::string identity_of(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{}:{}:{}:{}.{}", status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

}  // namespace kinespace::build_files
