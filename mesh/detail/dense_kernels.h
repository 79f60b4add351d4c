// Products of tall matrices that every machine computes to the same bits.
//
// A library's product adds up in an order that depends on the processor's vectors and caches. Here the order is written
// down: what is summed comes in blocks of fixed size, within a block one after the other; vectors run along independent
// results. All matrices are stored by rows; `stride` is the distance of rows in numbers.
#pragma once

#include <cstddef>

namespace kinespace {

struct ConstRows {
  const double* data;
  std::ptrdiff_t stride;
};
struct Rows {
  double* data;
  std::ptrdiff_t stride;
};

// out (p x q) = A' B for A (n x p), B (n x q).
void transposed_product(std::ptrdiff_t n, std::ptrdiff_t p, std::ptrdiff_t q, ConstRows a, ConstRows b, Rows out);

// B (n x q) -= A C for A (n x p), C (p x q).
void subtract_product(std::ptrdiff_t n, std::ptrdiff_t p, std::ptrdiff_t q, ConstRows a, ConstRows c, Rows b);

}  // namespace kinespace
