#include "tests/storage/disk_meter.h"

#include <atomic>
#include <csignal>
#include <cstdio>

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<std::int64_t> all_read{0};
std::atomic<std::int64_t> all_changes{0};
std::atomic<std::int64_t> last_change{-1};

void count_change() {
  if (++all_changes == last_change) ::raise(SIGKILL);
}

}  // namespace

// In the place of the C library's own, for the libraries of this process too.
extern "C" {
ssize_t pread64(int file, void* data, size_t size, off64_t offset) {
  const auto got = static_cast<ssize_t>(::syscall(SYS_pread64, file, data, size, offset));
  if (got > 0) all_read += got;
  return got;
}
ssize_t pwrite64(int file, const void* data, size_t size, off64_t offset) {
  count_change();
  return static_cast<ssize_t>(::syscall(SYS_pwrite64, file, data, size, offset));
}
int fdatasync(int file) {
  count_change();
  return static_cast<int>(::syscall(SYS_fdatasync, file));
}
int unlink(const char* path) noexcept {
  count_change();
  return ::unlinkat(AT_FDCWD, path, 0);
}
int rename(const char* from, const char* to) noexcept {
  count_change();
  return ::renameat(AT_FDCWD, from, AT_FDCWD, to);
}
}

namespace kinespace::test {

DiskMeter::DiskMeter() : start_read_(all_read), start_changes_(all_changes) {}

std::int64_t DiskMeter::bytes_read() const {
  return all_read - start_read_;
}

std::int64_t DiskMeter::changes() const {
  return all_changes - start_changes_;
}

void die_at_change(std::int64_t n) {
  last_change = all_changes + n;
}

}  // namespace kinespace::test
