#include "tests/motion/watched_text.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <system_error>

#include <sys/mman.h>

namespace kinespace::test {
namespace {

constexpr std::size_t part_bytes = std::size_t{1} << 16;
constexpr std::size_t open_at_once = 4;

// A signal handler reaches nothing but globals.
std::atomic<char*> watched_begin{nullptr};
std::atomic<std::size_t> watched_parts{0};
std::atomic<std::size_t> parts_opened{0};
std::array<std::atomic<char*>, open_at_once> parts_open;
struct sigaction former_action {};

void open_part(int signal, siginfo_t* info, void* /*context*/) {
  char* const begin = watched_begin.load();
  const auto offset = reinterpret_cast<std::uintptr_t>(info->si_addr) - reinterpret_cast<std::uintptr_t>(begin);
  if (begin == nullptr || offset >= watched_parts * part_bytes) {  // a fault that is none of ours comes again
    sigaction(signal, &former_action, nullptr);
    return;
  }
  std::atomic<char*>& slot = parts_open[parts_opened++ % open_at_once];
  if (slot != nullptr) mprotect(slot, part_bytes, PROT_NONE);
  slot = begin + offset / part_bytes * part_bytes;
  mprotect(slot, part_bytes, PROT_READ);
}

void require_done(bool done, const char* what) {
  if (!done) throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

WatchedText::WatchedText(std::string_view text) : size_(text.size()) {
  const std::size_t parts = (text.size() + part_bytes - 1) / part_bytes;
  void* const memory = mmap(nullptr, parts * part_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  require_done(memory != MAP_FAILED, "mmap");
  begin_ = static_cast<char*>(memory);
  std::memcpy(begin_, text.data(), text.size());
  require_done(mprotect(begin_, parts * part_bytes, PROT_NONE) == 0, "mprotect");
  for (auto& slot : parts_open) slot = nullptr;
  parts_opened = 0;
  watched_parts = parts;
  watched_begin = begin_;
  struct sigaction action {};
  action.sa_sigaction = open_part;
  action.sa_flags = SA_SIGINFO;
  require_done(sigaction(SIGSEGV, &action, &former_action) == 0, "sigaction");
}

WatchedText::~WatchedText() {
  sigaction(SIGSEGV, &former_action, nullptr);
  watched_begin = nullptr;
  munmap(begin_, parts() * part_bytes);
}

std::size_t WatchedText::parts() const {
  return watched_parts;
}

std::size_t WatchedText::opened() const {
  return parts_opened;
}

}  // namespace kinespace::test
