#include "kinespace/kernels/blas_call.h"

#include <cstddef>
#include <mutex>
#include <vector>

#include <cblas.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// What OpenBLAS asks for, and a little for what the call itself needs.
constexpr std::size_t blas_buffer_bytes = (std::size_t{128} << 20) + (std::size_t{1} << 20);

bool is_address_space_limited() {
  struct rlimit limit {};
  return ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
}

void require_address_space() {
  void* const memory =
      ::mmap(nullptr, blas_buffer_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) {
    throw Error(ErrorKind::machine, {.file = {},
                                     .line = 0,
                                     .found = "too little address space for the matrix products",
                                     .expected = "128 MiB more",
                                     .remedy = "raise the limit (ulimit -v)"});
  }
  ::munmap(memory, blas_buffer_bytes);
}

// A product large enough that OpenBLAS takes its buffer now, and not when others have taken the room.
void make_blas_take_its_buffer() {
  constexpr int n = 96;
  const std::vector<float> a(std::size_t{n} * n, 1.0F);
  std::vector<float> out(a.size());
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1, a.data(), n, a.data(), n, 0, out.data(), n);
}

struct BlasRoom {
  std::mutex mutex;
  bool taken = false;  // OpenBLAS has its buffer
};

BlasRoom& blas_room() {
  static BlasRoom room;
  return room;
}

}  // namespace

BlasCall::BlasCall() {
  static const bool limited = is_address_space_limited();
  if (!limited) return;
  BlasRoom& room = blas_room();
  alone_ = std::unique_lock(room.mutex);
  if (room.taken) return;
  require_address_space();
  make_blas_take_its_buffer();
  room.taken = true;
}

}  // namespace kinespace
