#include "tests/support/allocation_meter.h"

#include <atomic>
#include <cerrno>
#include <cstdlib>

#include <malloc.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define KINESPACE_OWN_HEAP 0
#else
#define KINESPACE_OWN_HEAP 1
#endif

namespace {

std::atomic<std::size_t> held{0};
std::atomic<std::size_t> most{0};
std::atomic<std::size_t> all{0};
std::atomic<std::size_t> handed_out{0};

}  // namespace

#if KINESPACE_OWN_HEAP
// glibc's own allocator under its other names; ours count and pass on.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

static void* counted(void* block) {
  if (block == nullptr) return block;
  const std::size_t size = malloc_usable_size(block);
  all += size;
  ++handed_out;
  const std::size_t now = held.fetch_add(size) + size;
  std::size_t before = most.load();
  while (before < now && !most.compare_exchange_weak(before, now)) {
  }
  return block;
}
static void released(void* block) {
  if (block != nullptr) held.fetch_sub(malloc_usable_size(block));
}

void* malloc(std::size_t size) {
  return counted(__libc_malloc(size));
}
void* calloc(std::size_t count, std::size_t size) {
  return counted(__libc_calloc(count, size));
}
void* realloc(void* old, std::size_t size) {
  const std::size_t before = old != nullptr ? malloc_usable_size(old) : 0;
  void* const block = __libc_realloc(old, size);
  if (block != nullptr || size == 0) held.fetch_sub(before);
  return counted(block);
}
void* memalign(std::size_t alignment, std::size_t size) {
  return counted(__libc_memalign(alignment, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return counted(__libc_memalign(alignment, size));
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  void* const block = counted(__libc_memalign(alignment, size));
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}
void free(void* block) {
  released(block);
  __libc_free(block);
}
}
#endif

namespace kinespace::test {

AllocationMeter::AllocationMeter() : start_(held.load()), start_bytes_(all.load()), start_pieces_(handed_out.load()) {
  most.store(start_);
}

bool AllocationMeter::counts() {
  return KINESPACE_OWN_HEAP == 1;
}

std::size_t AllocationMeter::peak() const {
  const std::size_t now = most.load();
  return now > start_ ? now - start_ : 0;
}

std::size_t AllocationMeter::all_bytes() const {
  return all.load() - start_bytes_;
}

std::size_t AllocationMeter::pieces() const {
  return handed_out.load() - start_pieces_;
}

}  // namespace kinespace::test
