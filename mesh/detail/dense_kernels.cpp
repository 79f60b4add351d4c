#include "kinespace/mesh/detail/dense_kernels.h"

#include <algorithm>

#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

constexpr std::ptrdiff_t wide = 8;  // results in a row of a tile
constexpr std::ptrdiff_t high = 4;
constexpr std::ptrdiff_t row_block = 64;
constexpr std::ptrdiff_t columns_at_once = 128;
constexpr std::ptrdiff_t widest = 32;

template <std::ptrdiff_t Height, std::ptrdiff_t Width>
[[gnu::always_inline]] inline void add_tile(std::ptrdiff_t n, ConstRows a, ConstRows b, Rows out) {
  double sum[Height][Width] = {};
  for (std::ptrdiff_t r = 0; r < n; ++r) {
    const double* const x = a.data + r * a.stride;
    const double* const y = b.data + r * b.stride;
    for (std::ptrdiff_t i = 0; i < Height; ++i) {
      for (std::ptrdiff_t j = 0; j < Width; ++j) sum[i][j] += x[i] * y[j];
    }
  }
  for (std::ptrdiff_t i = 0; i < Height; ++i) {
    for (std::ptrdiff_t j = 0; j < Width; ++j) out.data[i * out.stride + j] += sum[i][j];
  }
}

template <std::ptrdiff_t Height>
[[gnu::always_inline]] inline void add_band(std::ptrdiff_t n, std::ptrdiff_t q, ConstRows a, ConstRows b, Rows out) {
  std::ptrdiff_t j = 0;
  for (; j + wide <= q; j += wide) add_tile<Height, wide>(n, a, {b.data + j, b.stride}, {out.data + j, out.stride});
  for (; j < q; ++j) add_tile<Height, 1>(n, a, {b.data + j, b.stride}, {out.data + j, out.stride});
}

// A band of up to `high` rows of A, turned so that its columns follow each other, times C.
template <std::ptrdiff_t Height>
[[gnu::always_inline]] inline void subtract_band(std::ptrdiff_t p, std::ptrdiff_t q, ConstRows a, ConstRows c, Rows b) {
  double turned[columns_at_once * Height];
  double product[Height * widest];
  for (std::ptrdiff_t left = 0; left < q; left += widest) {
    const std::ptrdiff_t width = std::min(widest, q - left);
    std::fill_n(product, Height * widest, 0.0);
    for (std::ptrdiff_t first = 0; first < p; first += columns_at_once) {
      const std::ptrdiff_t count = std::min(columns_at_once, p - first);
      for (std::ptrdiff_t i = 0; i < Height; ++i) {
        for (std::ptrdiff_t k = 0; k < count; ++k) turned[k * Height + i] = a.data[i * a.stride + first + k];
      }
      add_band<Height>(count, width, {turned, Height}, {c.data + first * c.stride + left, c.stride}, {product, widest});
    }
    for (std::ptrdiff_t i = 0; i < Height; ++i) {
      for (std::ptrdiff_t j = 0; j < width; ++j) b.data[i * b.stride + left + j] -= product[i * widest + j];
    }
  }
}

}  // namespace

KINESPACE_VECTOR_CLONES
void transposed_product(std::ptrdiff_t n, std::ptrdiff_t p, std::ptrdiff_t q, ConstRows a, ConstRows b, Rows out) {
  for (std::ptrdiff_t i = 0; i < p; ++i) std::fill_n(out.data + i * out.stride, q, 0.0);
  for (std::ptrdiff_t r = 0; r < n; r += row_block) {
    const std::ptrdiff_t rows = std::min(row_block, n - r);
    const ConstRows b_rows{b.data + r * b.stride, b.stride};
    std::ptrdiff_t i = 0;
    for (; i + high <= p; i += high) {
      add_band<high>(rows, q, {a.data + r * a.stride + i, a.stride}, b_rows, {out.data + i * out.stride, out.stride});
    }
    for (; i < p; ++i) {
      add_band<1>(rows, q, {a.data + r * a.stride + i, a.stride}, b_rows, {out.data + i * out.stride, out.stride});
    }
  }
}

KINESPACE_VECTOR_CLONES
void subtract_product(std::ptrdiff_t n, std::ptrdiff_t p, std::ptrdiff_t q, ConstRows a, ConstRows c, Rows b) {
  std::ptrdiff_t r = 0;
  for (; r + high <= n; r += high) {
    subtract_band<high>(p, q, {a.data + r * a.stride, a.stride}, c, {b.data + r * b.stride, b.stride});
  }
  for (; r < n; ++r) subtract_band<1>(p, q, {a.data + r * a.stride, a.stride}, c, {b.data + r * b.stride, b.stride});
}

}  // namespace kinespace
