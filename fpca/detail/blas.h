// The few BLAS calls that the hot paths of fpca make on memory they own, and the rule for BLAS threads.
//
// Curves are row-major, one curve a row. Private to this folder.
#pragma once

#include <cstddef>

namespace kinespace::blas {

// OpenBLAS starts threads of its own for products and eigenproblems of this size, which then wait for each other: on a
// busy machine that was 300 times slower than one thread. Parallel work in kinespace runs over oneTBB, so OpenBLAS is
// told once, for the whole process, to use the calling thread only; results then do not depend on the machine's cores
// either.
void use_one_thread();

// Adds x' x to the lower triangle of c (n x n, column-major), x: rows x n with `stride` numbers from row to row.
void add_gram(const double* x, std::ptrdiff_t rows, std::ptrdiff_t n, std::ptrdiff_t stride, double* c);

// out (rows x k, contiguous) becomes beta * out + x (rows x n, with a stride) times the transpose of p (k x n,
// contiguous).
void project_rows(const double* x, std::ptrdiff_t rows, std::ptrdiff_t n, std::ptrdiff_t stride, const double* p,
                  std::ptrdiff_t k, double beta, double* out);

}  // namespace kinespace::blas
