#include "kinespace/base/file.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file_kind.h"

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

void write_all(int fd, const FileToWrite& file) {
  write_all(fd, file.content, file.path);
  if (file.more) file.more([&](std::string_view piece) { write_all(fd, piece, file.path); });
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
void write_to_device(const FileToWrite& file) {
  const Descriptor fd(::open(file.path.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd.get() < 0) fail(ErrorKind::machine, file.path, "cannot open", errno, "check its permissions");
  write_all(fd.get(), file);
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
  explicit PendingFile(const FileToWrite& file) : PendingFile(file.path) {
    const std::filesystem::path& path = file.path;
    std::error_code code;
    target_ = std::filesystem::weakly_canonical(std::filesystem::absolute(path, code), code);
    if (code) fail(ErrorKind::machine, path, "cannot be found", code.value(), "check the path and the working folder");
    require_replaceable(target_, file_kind(std::as_bytes(std::span(file.content))));
    const Descriptor opened(create_temporary(folder(), name_));
    if (opened.get() < 0) {
      const int why = errno;
      name_.clear();
      fail(ErrorKind::machine, path, "cannot create a file in " + folder().string(), why,
           "check that the folder exists and is writable");
    }
    fill(opened, file);
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

  void fill(const Descriptor& opened, const FileToWrite& file) const {
    write_all(opened.get(), file);
    // A file that was there keeps its permissions.
    struct stat old {};
    if (::stat(target_.c_str(), &old) == 0) ::fchmod(opened.get(), old.st_mode & 07777);
    if (::fsync(opened.get()) != 0) {
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

std::string hexadecimal(const XXH128_hash_t& hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace

FileReader::FileReader(std::filesystem::path path) : path_(std::move(path)) {
  // Non-blocking: opening a pipe that nobody writes to would wait for ever.
  Descriptor fd(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0 && errno == ENOENT) {
    throw Error(ErrorKind::bad_input, {.file = path_.string(), .found = "no such file", .remedy = "check the path"});
  }
  if (fd.get() < 0) fail(ErrorKind::bad_input, path_, "cannot open", errno, "check its permissions");
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) fail(ErrorKind::machine, path_, "cannot stat", errno, "");
  if (!S_ISREG(status.st_mode)) {
    throw Error(ErrorKind::bad_input, {.file = path_.string(), .found = "not a regular file", .expected = "a file"});
  }
  size_ = static_cast<std::size_t>(status.st_size);
  fd_ = fd.release();
}

FileReader::~FileReader() {
  if (fd_ >= 0) ::close(fd_);
}

FileReader::FileReader(FileReader&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)), size_(other.size_), at_(other.at_) {}

// Read, not mapped: what another process cuts off a mapped file is a signal when it is touched.
std::size_t FileReader::read(std::span<char> room) {
  const auto changed = [&](std::string found) {
    throw Error(ErrorKind::bad_input, {.file = path_.string(),
                                       .found = std::move(found),
                                       .expected = "a file that stays as it is while it is read",
                                       .remedy = "wait until it is complete"});
  };
  room = room.first(std::min(room.size(), remaining()));
  for (std::size_t done = 0; done < room.size();) {
    const ssize_t got = ::read(fd_, room.data() + done, room.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(ErrorKind::machine, path_, "cannot read", errno, "check the disk");
    if (got == 0) changed(fmt::format("its end after {} bytes, which were {} when it was opened", at_, size_));
    done += static_cast<std::size_t>(got);
    at_ += static_cast<std::size_t>(got);
  }
  struct stat status {};
  if (remaining() == 0 && ::fstat(fd_, &status) == 0 && static_cast<std::size_t>(status.st_size) != size_) {
    changed(fmt::format("{} bytes, which were {} when it was opened", status.st_size, size_));
  }
  return room.size();
}

FileContent::FileContent(const std::filesystem::path& path) : FileContent() {
  FileReader file(path);
  if (file.size() == 0) return;
  void* data = ::mmap(nullptr, file.size(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) {
    fail(ErrorKind::machine, path, fmt::format("cannot hold its {} bytes", file.size()), errno, "close other programs");
  }
  size_ = file.size();
  ::madvise(data, size_, MADV_HUGEPAGE);  // a fault for 2 MiB instead of one for each 4 KiB
  data_ = static_cast<char*>(data);
  file.read({data_, size_});
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
    if (!is_device(file.path)) pending.emplace_back(file);
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
    if (is_device(file.path)) write_to_device(file);
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
  return hexadecimal(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string hash_of_file(const std::filesystem::path& path) {
  constexpr std::size_t piece_bytes = 1 << 20;
  FileReader file(path);
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  std::vector<char> piece(std::min(piece_bytes, file.size()));
  while (file.remaining() > 0) XXH3_128bits_update(state.get(), piece.data(), file.read(piece));
  return hexadecimal(XXH3_128bits_digest(state.get()));
}

std::string start_of_file(const std::filesystem::path& path) {
  FileReader file(path);
  std::string out(std::min(file_kind_bytes, file.size()), '\0');
  file.read(out);
  return out;
}

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace kinespace
