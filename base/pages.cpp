#include "kinespace/base/pages.h"

#include <cstdint>

#include <sys/mman.h>
#include <unistd.h>

namespace kinespace {

void discard_pages(std::span<double> values) noexcept {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(values.data());
  const std::uintptr_t first = (begin + page - 1) / page * page;
  const std::uintptr_t last = (begin + values.size_bytes()) / page * page;
  // A system that will not keeps the memory a little longer.
  if (first < last) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_DONTNEED);
}

}  // namespace kinespace
