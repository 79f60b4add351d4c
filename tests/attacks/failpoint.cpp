// Loaded before a program's own libraries (LD_PRELOAD), makes its N-th call of a kind fail, once, or kills it there.
//
//   KINESPACE_FAILPOINT=alloc:N   the N-th allocation (from 1) returns no memory
//   KINESPACE_FAILPOINT=disk:N    the N-th call that changes a file fails as on a full disk (ENOSPC)
//   KINESPACE_FAILPOINT=kill:N    the process is killed (SIGKILL) before its N-th call that changes a file
//   KINESPACE_FAILPOINT_COUNT=F   at the end, the numbers of both kinds of calls are written into file F
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

enum class Wish { none, alloc, disk, kill };

Wish wish = Wish::none;
long wanted = 0;
std::atomic<long> allocations{0};
std::atomic<long> changes{0};

// Calls are counted while main() runs: before and after it there is nobody to tell.
std::atomic<bool> in_main{false};
int (*real_main)(int, char**, char**) = nullptr;

void read_wish() {
  const char* text = std::getenv("KINESPACE_FAILPOINT");
  if (text == nullptr) return;
  const char* number = std::strchr(text, ':');
  if (number != nullptr) std::from_chars(number + 1, text + std::strlen(text), wanted);
  const auto is = [&](const char* name) { return std::strncmp(text, name, std::strlen(name)) == 0; };
  wish = is("alloc") ? Wish::alloc : is("disk") ? Wish::disk : is("kill") ? Wish::kill : Wish::none;
}

void write_counts() {
  const char* path = std::getenv("KINESPACE_FAILPOINT_COUNT");
  if (path == nullptr) return;
  if (std::FILE* file = std::fopen(path, "w")) {
    std::fprintf(file, "%ld %ld\n", allocations.load(), changes.load());
    std::fclose(file);
  }
}

int counted_main(int argc, char** argv, char** environment) {
  read_wish();
  in_main = true;
  const int code = real_main(argc, argv, environment);
  in_main = false;
  write_counts();
  return code;
}

bool alloc_fails() {
  if (!in_main) return false;
  const bool fails = ++allocations == wanted && wish == Wish::alloc;
  if (fails) errno = ENOMEM;
  return fails;
}

bool change_fails() {
  if (!in_main) return false;
  if (++changes != wanted || wish == Wish::none || wish == Wish::alloc) return false;
  if (wish == Wish::kill) ::kill(::getpid(), SIGKILL);
  errno = ENOSPC;
  return true;
}

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool is_file(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

}  // namespace

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(), void (*end)(),
                      void (*loader_end)(), void* stack) {
  real_main = main;
  static auto* const real =
      next<int(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*)>(
          "__libc_start_main");
  return real(counted_main, argc, argv, init, end, loader_end, stack);
}

void* malloc(std::size_t size) {
  return alloc_fails() ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  return alloc_fails() ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  return alloc_fails() ? nullptr : __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return alloc_fails() ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = alloc_fails() ? nullptr : __libc_memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}

ssize_t write(int fd, const void* data, std::size_t size) {
  static auto* const real = next<ssize_t(int, const void*, std::size_t)>("write");
  return is_file(fd) && change_fails() ? -1 : real(fd, data, size);
}
ssize_t pwrite(int fd, const void* data, std::size_t size, off_t at) {
  static auto* const real = next<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  return change_fails() ? -1 : real(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, std::size_t size, off64_t at) {
  static auto* const real = next<ssize_t(int, const void*, std::size_t, off64_t)>("pwrite64");
  return change_fails() ? -1 : real(fd, data, size, at);
}
int fsync(int fd) {
  static auto* const real = next<int(int)>("fsync");
  return change_fails() ? -1 : real(fd);
}
int fdatasync(int fd) {
  static auto* const real = next<int(int)>("fdatasync");
  return change_fails() ? -1 : real(fd);
}
int ftruncate(int fd, off_t size) {
  static auto* const real = next<int(int, off_t)>("ftruncate");
  return change_fails() ? -1 : real(fd, size);
}
int ftruncate64(int fd, off64_t size) {
  static auto* const real = next<int(int, off64_t)>("ftruncate64");
  return change_fails() ? -1 : real(fd, size);
}
int rename(const char* from, const char* to) {
  static auto* const real = next<int(const char*, const char*)>("rename");
  return change_fails() ? -1 : real(from, to);
}
int link(const char* from, const char* to) {
  static auto* const real = next<int(const char*, const char*)>("link");
  return change_fails() ? -1 : real(from, to);
}
int unlink(const char* path) {
  static auto* const real = next<int(const char*)>("unlink");
  // A full disk lets files go; a kill may come before.
  if (wish == Wish::kill) change_fails();
  return real(path);
}
int mkdir(const char* path, mode_t mode) {
  static auto* const real = next<int(const char*, mode_t)>("mkdir");
  return change_fails() ? -1 : real(path, mode);
}

}  // extern "C"
