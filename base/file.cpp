#include "base/file.h"

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "base/error.h"

namespace kinespace {
namespace {

[[noreturn]] void fail(ErrorKind kind, const std::filesystem::path& path, const std::string& what, int code,
                       const std::string& remedy) {
  throw Error(kind,
              {.file = path.string(), .found = what + ": " + std::generic_category().message(code), .remedy = remedy});
}

// Closes a descriptor at the end of a scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return fd_; }
  int release() noexcept { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// Removes a file at the end of a scope unless it was kept.
class TemporaryName {
 public:
  explicit TemporaryName(std::string name) : name_(std::move(name)) {}
  ~TemporaryName() {
    if (!kept_) ::unlink(name_.c_str());
  }
  TemporaryName(const TemporaryName&) = delete;
  TemporaryName& operator=(const TemporaryName&) = delete;
  void keep() noexcept { kept_ = true; }

 private:
  std::string name_;
  bool kept_ = false;
};

void write_all(int fd, std::string_view content, const std::filesystem::path& path) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd, content.data(), content.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(ErrorKind::machine, path, "cannot write", errno, "free some space or choose another place");
    }
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

// A new file beside the target, under a short name so that any target's name leaves room for it. Opened plainly, so
// that its permissions are those of any new file.
int create_temporary(const std::filesystem::path& folder, std::string& name) {
  static std::atomic<unsigned> count{0};
  for (;;) {
    name = (folder / fmt::format(".kinespace-{}-{}", ::getpid(), count++)).string();
    const int fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
}

// A terminal, a pipe, /dev/null: nothing to replace, and nothing that may be replaced.
bool write_to_device(const std::filesystem::path& path, std::string_view content) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)) return false;
  const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd.get() < 0) fail(ErrorKind::machine, path, "cannot open", errno, "check its permissions");
  write_all(fd.get(), content, path);
  return true;
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& path) {
  // Non-blocking: opening a pipe that nobody writes to would wait for ever.
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) {
    fail(ErrorKind::bad_input, path, "cannot open", errno, "check the path and its permissions");
  }
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) fail(ErrorKind::machine, path, "cannot stat", errno, "");
  if (!S_ISREG(status.st_mode)) {
    throw Error(ErrorKind::bad_input, {.file = path.string(), .found = "not a regular file", .expected = "a file"});
  }
  size_ = static_cast<std::size_t>(status.st_size);
  if (size_ == 0) return;
  void* data = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd.get(), 0);
  if (data == MAP_FAILED) fail(ErrorKind::machine, path, "cannot map", errno, "");
  ::madvise(data, size_, MADV_SEQUENTIAL);
  data_ = static_cast<const char*>(data);
}

MappedFile::~MappedFile() {
  if (data_ != nullptr) ::munmap(const_cast<char*>(data_), size_);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  if (write_to_device(path, content)) return;
  std::error_code code;
  std::filesystem::path target = std::filesystem::weakly_canonical(std::filesystem::absolute(path), code);
  if (code) target = std::filesystem::absolute(path);
  const std::filesystem::path folder = target.parent_path();
  std::string name;
  Descriptor fd(create_temporary(folder, name));
  if (fd.get() < 0) {
    fail(ErrorKind::machine, path, "cannot create a file in " + folder.string(), errno,
         "check that the folder exists and is writable");
  }
  TemporaryName temporary(name);
  write_all(fd.get(), content, path);
  // A file that was there keeps its permissions.
  struct stat old {};
  if (::stat(target.c_str(), &old) == 0) ::fchmod(fd.get(), old.st_mode & 07777);
  if (::fsync(fd.get()) != 0) {
    fail(ErrorKind::machine, path, "cannot flush", errno, "free some space or choose another place");
  }
  if (::close(fd.release()) != 0) fail(ErrorKind::machine, path, "cannot close", errno, "");
  if (::rename(name.c_str(), target.c_str()) != 0) {
    fail(ErrorKind::machine, path, "cannot replace the file", errno, "check that it is a file and writable");
  }
  temporary.keep();
  // The rename itself must survive a power cut; a file system that cannot sync a folder has done what it can.
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());
}

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content) {
  write_file_atomically(path, std::string_view(reinterpret_cast<const char*>(content.data()), content.size()));
}

void require_different_files(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code ignored;
  if (std::filesystem::equivalent(input, output, ignored)) {
    throw Error(ErrorKind::usage, {.file = output.string(),
                                   .found = "the output is the input",
                                   .expected = "two different files",
                                   .remedy = "give another output name"});
  }
}

std::string content_hash(std::span<const std::byte> bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace kinespace
