// The command's heap: large blocks in large pages.
//
// Clips, texts and streams are blocks of many megabytes, each mapped anew, and the first touch of every 4 KiB of them
// is a page fault: up to a third of the time that reading and writing took. Where the machine has pages of 2 MiB these
// are asked for, which makes one fault of 512. Only here: what a program that uses the libraries does with its memory
// is its own affair.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

#include <sys/mman.h>

namespace {

constexpr std::size_t large_bytes = std::size_t{4} << 20;
constexpr std::uintptr_t page_bytes = 4096;

void ask_for_large_pages(void* memory, std::size_t size) noexcept {
  const std::uintptr_t first = (reinterpret_cast<std::uintptr_t>(memory) + page_bytes - 1) / page_bytes * page_bytes;
  const std::uintptr_t last = (reinterpret_cast<std::uintptr_t>(memory) + size) / page_bytes * page_bytes;
  // A kernel that has none goes on with small ones.
  ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
}

}  // namespace

void* operator new(std::size_t size) {
  void* memory = nullptr;
  while ((memory = std::malloc(size == 0 ? 1 : size)) == nullptr) {
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
  if (size >= large_bytes) ask_for_large_pages(memory, size);
  return memory;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

#endif
