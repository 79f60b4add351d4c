#include "kinespace/fpca/detail/blas.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/kernels/blas_call.h"

extern "C" {
// Missing in other BLAS libraries, hence weak.
void openblas_set_num_threads(int threads) __attribute__((weak));
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha, const double* a,
            const int* lda, const double* beta, double* c, const int* ldc);
void dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* b, const int* ldb, const double* beta, double* c,
            const int* ldc);
}

namespace kinespace::blas {
namespace {

int blas_size(std::ptrdiff_t value) {
  if (value > std::numeric_limits<int>::max()) {
    throw Error(ErrorKind::usage, {.found = std::to_string(value) + " rows or columns at once",
                                   .expected = "fewer than 2^31",
                                   .remedy = "pass the curves in blocks"});
  }
  return static_cast<int>(value);
}

}  // namespace

void use_one_thread() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
  });
}

// A row-major matrix is the transpose of the column-major one that BLAS sees.
void add_gram(const double* x, std::ptrdiff_t rows, std::ptrdiff_t n, std::ptrdiff_t stride, double* c) {
  if (rows == 0 || n == 0) return;
  const int size = blas_size(n), count = blas_size(rows), lead = std::max(size, blas_size(stride));
  const double one = 1;
  const BlasCall call;
  dsyrk_("L", "N", &size, &count, &one, x, &lead, &one, c, &size);
}

void project_rows(const double* x, std::ptrdiff_t rows, std::ptrdiff_t n, std::ptrdiff_t stride, const double* p,
                  std::ptrdiff_t k, double beta, double* out) {
  if (rows == 0 || k == 0) return;
  const int m = blas_size(k), count = blas_size(rows), inner = blas_size(n);
  const int lead = std::max({1, inner, blas_size(stride)}), p_lead = std::max(1, inner);
  const double one = 1;
  const BlasCall call;
  dgemm_("T", "N", &m, &count, &inner, &one, p, &p_lead, x, &lead, &beta, out, &m);
}

}  // namespace kinespace::blas
