#include "base/file.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
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
#include "base/file_kind.h"

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

constexpr std::string_view temporary_prefix = ".kinespace-";

// Short, so that any target's name leaves room for it; the process is in it, so that what a killed one left is known.
std::string temporary_name(const std::filesystem::path& folder) {
  static std::atomic<unsigned> count{0};
  return (folder / fmt::format("{}{}-{}", temporary_prefix, ::getpid(), count++)).string();
}

// Opened plainly, so that its permissions are those of any new file.
int create_temporary(const std::filesystem::path& folder, std::string& name) {
  for (;;) {
    name = temporary_name(folder);
    const int fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
}

bool is_device(const std::filesystem::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

// A terminal, a pipe, /dev/null: nothing to replace, and nothing that may be replaced.
void write_to_device(const std::filesystem::path& path, std::string_view content) {
  const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd.get() < 0) fail(ErrorKind::machine, path, "cannot open", errno, "check its permissions");
  write_all(fd.get(), content, path);
}

FileKind kind_on_disk(const std::filesystem::path& path) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) return FileKind::empty;  // none there, or none that we may look into: then we may not replace it
  std::array<std::byte, file_kind_bytes> start{};
  const ssize_t got = ::pread(fd.get(), start.data(), start.size(), 0);
  return file_kind(std::span(start).first(got > 0 ? static_cast<std::size_t>(got) : 0));
}

void sync_folder(const std::filesystem::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());  // a file system that cannot has done what it can
}

// A file that lies whole and flushed beside its target, under a temporary name, until it is put in its place.
class PendingFile {
 public:
  PendingFile(const std::filesystem::path& path, std::string_view content) : PendingFile(path) {
    std::error_code code;
    target_ = std::filesystem::weakly_canonical(std::filesystem::absolute(path, code), code);
    if (code) fail(ErrorKind::machine, path, "cannot be found", code.value(), "check the path and the working folder");
    require_replaceable(target_, file_kind(std::as_bytes(std::span(content))));
    const Descriptor opened(create_temporary(folder(), name_));
    if (opened.get() < 0) {
      const int why = errno;
      name_.clear();
      fail(ErrorKind::machine, path, "cannot create a file in " + folder().string(), why,
           "check that the folder exists and is writable");
    }
    fill(opened, content);
  }
  ~PendingFile() { discard(); }
  PendingFile(PendingFile&& other) noexcept
      : shown_(std::move(other.shown_)),
        target_(std::move(other.target_)),
        name_(std::exchange(other.name_, {})),
        old_(std::exchange(other.old_, {})) {}
  PendingFile& operator=(PendingFile&&) = delete;

  [[nodiscard]] std::filesystem::path folder() const { return target_.parent_path(); }

  // Keeps what is there under a second name, for take_back.
  void keep_old() {
    for (int tries = 0; tries < 100 && ::access(target_.c_str(), F_OK) == 0; ++tries) {
      const std::string name = temporary_name(folder());
      if (::link(target_.c_str(), name.c_str()) == 0) {
        old_ = name;
        return;
      }
      if (errno != EEXIST) return;  // a file system without links: the old one goes when the new one comes
    }
  }
  void put_in_place() {
    if (::rename(name_.c_str(), target_.c_str()) != 0) {
      fail(ErrorKind::machine, shown_, "cannot replace the file", errno, "check that it is a file and writable");
    }
    name_.clear();
  }
  void take_back() noexcept {
    if (!name_.empty()) return;  // never put in place
    if (old_.empty()) {
      ::unlink(target_.c_str());
    } else if (::rename(old_.c_str(), target_.c_str()) == 0) {
      old_.clear();
    }
  }

 private:
  // The constructor that is done when the other one begins its work: from then on the destructor clears up.
  explicit PendingFile(const std::filesystem::path& path) : shown_(path) {}

  void fill(const Descriptor& file, std::string_view content) const {
    write_all(file.get(), content, shown_);
    // A file that was there keeps its permissions.
    struct stat old {};
    if (::stat(target_.c_str(), &old) == 0) ::fchmod(file.get(), old.st_mode & 07777);
    if (::fsync(file.get()) != 0) {
      fail(ErrorKind::machine, shown_, "cannot flush", errno, "free some space or choose another place");
    }
  }
  void discard() noexcept {
    if (!name_.empty()) ::unlink(name_.c_str());
    if (!old_.empty()) ::unlink(old_.c_str());
  }

  std::filesystem::path shown_, target_;
  std::string name_;  // empty once it is in place
  std::string old_;   // of what was there before
};

// The process that made a temporary of this name; 0 for what is none.
::pid_t maker_of(std::string_view name) {
  if (!name.starts_with(temporary_prefix)) return 0;
  name.remove_prefix(temporary_prefix.size());
  ::pid_t maker = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), maker);
  return error == std::errc() && end != name.data() + name.size() && *end == '-' && maker > 0 ? maker : 0;
}

}  // namespace

FileContent::FileContent(const std::filesystem::path& path) : FileContent() {
  // Non-blocking: opening a pipe that nobody writes to would wait for ever.
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0 && errno == ENOENT) {
    throw Error(ErrorKind::bad_input, {.file = path.string(), .found = "no such file", .remedy = "check the path"});
  }
  if (fd.get() < 0) fail(ErrorKind::bad_input, path, "cannot open", errno, "check its permissions");
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) fail(ErrorKind::machine, path, "cannot stat", errno, "");
  if (!S_ISREG(status.st_mode)) {
    throw Error(ErrorKind::bad_input, {.file = path.string(), .found = "not a regular file", .expected = "a file"});
  }
  size_ = static_cast<std::size_t>(status.st_size);
  if (size_ == 0) return;
  void* data = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) {
    fail(ErrorKind::machine, path, fmt::format("cannot hold its {} bytes", size_), errno, "close other programs");
  }
  ::madvise(data, size_, MADV_HUGEPAGE);  // a fault for 2 MiB instead of one for each 4 KiB
  data_ = static_cast<char*>(data);
  read_whole(fd.get(), path);
}

// Read, not mapped: what another process cuts off a mapped file is a signal when it is touched.
void FileContent::read_whole(int fd, const std::filesystem::path& path) {
  const auto changed = [&](std::string found) {
    throw Error(ErrorKind::bad_input, {.file = path.string(),
                                       .found = std::move(found),
                                       .expected = "a file that stays as it is while it is read",
                                       .remedy = "wait until it is complete"});
  };
  for (std::size_t at = 0; at < size_;) {
    const ssize_t got = ::read(fd, data_ + at, size_ - at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(ErrorKind::machine, path, "cannot read", errno, "check the disk");
    if (got == 0) changed(fmt::format("its end after {} bytes, which were {} when it was opened", at, size_));
    at += static_cast<std::size_t>(got);
  }
  struct stat status {};
  if (::fstat(fd, &status) == 0 && static_cast<std::size_t>(status.st_size) != size_) {
    changed(fmt::format("{} bytes, which were {} when it was opened", status.st_size, size_));
  }
}

FileContent::~FileContent() {
  if (data_ != nullptr) ::munmap(data_, size_);
}

FileContent::FileContent(FileContent&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

FileContent& FileContent::operator=(FileContent&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

void write_files_atomically(std::span<const FileToWrite> files) {
  std::vector<PendingFile> pending;
  pending.reserve(files.size());
  for (const FileToWrite& file : files) {
    if (!is_device(file.path)) pending.emplace_back(file.path, file.content);
  }
  if (pending.size() > 1) {
    for (PendingFile& file : pending) file.keep_old();
  }
  try {
    for (PendingFile& file : pending) file.put_in_place();
  } catch (const Error&) {
    for (PendingFile& file : pending) file.take_back();
    throw;
  }
  // The renames themselves must survive a power cut.
  for (const PendingFile& file : pending) sync_folder(file.folder());
  for (const FileToWrite& file : files) {
    if (is_device(file.path)) write_to_device(file.path, file.content);
  }
}

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  const FileToWrite file{path, content};
  write_files_atomically(std::span(&file, 1));
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

void require_replaceable(const std::filesystem::path& path, FileKind kind) {
  if (is_device(path)) return;
  const FileKind there = kind_on_disk(path);
  if (there == FileKind::empty || there == kind) return;
  throw Error(ErrorKind::usage, {.file = path.string(),
                                 .found = std::string(describe(there)) + " of that name",
                                 .expected = "no file, or " + std::string(describe(kind)) + " to replace",
                                 .remedy = "give another output name, or remove the file"});
}

void remove_leftovers(const std::filesystem::path& folder) {
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const ::pid_t maker = maker_of(it->path().filename().native());
    if (maker == 0 || ::kill(maker, 0) == 0 || errno != ESRCH) continue;
    std::error_code ignored;  // what is not ours to remove stays
    std::filesystem::remove_all(it->path(), ignored);
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
