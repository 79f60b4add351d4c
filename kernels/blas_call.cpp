#include "kernels/blas_call.h"

#include <condition_variable>
#include <cstddef>
#include <mutex>

#include <sys/mman.h>

#include "base/error.h"

namespace kinespace {
namespace {

// What OpenBLAS asks for, and a little for what the call itself needs.
constexpr std::size_t blas_buffer_bytes = (std::size_t{128} << 20) + (std::size_t{1} << 20);

// OpenBLAS has one set of buffers for the process.
struct BlasRoom {
  std::mutex mutex;
  std::condition_variable left;
  int buffers = 0;  // that OpenBLAS has or may take
  int inside = 0;   // threads
};

BlasRoom& blas_room() {
  static BlasRoom room;
  return room;
}

bool has_address_space() {
  void* const memory =
      mmap(nullptr, blas_buffer_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return false;
  munmap(memory, blas_buffer_bytes);
  return true;
}

}  // namespace

BlasCall::BlasCall() {
  BlasRoom& room = blas_room();
  std::unique_lock lock(room.mutex);
  while (room.inside == room.buffers) {
    if (has_address_space()) {
      ++room.buffers;
    } else if (room.buffers > 0) {
      room.left.wait(lock);
    } else {
      throw Error(ErrorKind::machine, {.file = {},
                                       .line = 0,
                                       .found = "too little address space for the matrix products",
                                       .expected = "128 MiB more",
                                       .remedy = "raise the limit (ulimit -v)"});
    }
  }
  ++room.inside;
}

BlasCall::~BlasCall() {
  BlasRoom& room = blas_room();
  const std::scoped_lock lock(room.mutex);
  --room.inside;
  room.left.notify_one();
}

}  // namespace kinespace
