// out = (a - shift) b + offset: shift is taken from every row of a, offset added to every row of the product. b's rows
// and the offset are padded with zeros to a multiple of 64. Projection: a curves, shift their mean, b the projection;
// reconstruction: a scores, b the transposed functions, offset the mean.

typedef struct {
  __global const float* a;
  __global const float* b;
  __global const float* shift;
  int depth;
  int b_stride;
} Operands;

inline float a_value(Operands o, int i, int k) {
  return o.a[(size_t)i * o.depth + k] - o.shift[k];
}
inline float b_value(Operands o, int k, int j) {
  return o.b[(size_t)k * o.b_stride + j];
}
inline float16 b_values(Operands o, int k, int j) {
  return vload16(0, o.b + (size_t)k * o.b_stride + j);
}

#define A_ROWS_APART 1
#include "matrix_tile.cl"

#if WITH_LANES
__kernel
    __attribute__((reqd_work_group_size(1, 1, 1)))
#else
__kernel
    __attribute__((reqd_work_group_size(ITEM_SIDE, ITEM_SIDE, 1)))
#endif
    void
    projection(__global const float* restrict a, __global const float* restrict b, __global const float* restrict shift,
               __global const float* restrict offset, int n, int m, int depth, int b_stride,
               __global float* restrict out) {
  const Operands o = {a, b, shift, depth, b_stride};
  const int j0 = get_group_id(0) * TILE_COLUMNS;
  const int i0 = get_group_id(1) * TILE_ROWS;
#if WITH_LANES
  float16 sums[TILE_ROWS][2];
  tile_product(o, i0, n, j0, 0, depth, sums);
  for (int r = 0; r < TILE_ROWS && i0 + r < n; ++r) {
    for (int v = 0; v < 2; ++v) {
      const int j = j0 + 16 * v;
      store_part(sums[r][v] + vload16(0, offset + j), m - j, out + (size_t)(i0 + r) * m + j);
    }
  }
#else
  __local float a_tile[TILE_DEPTH][TILE_ROWS + 1];
  __local float b_tile[TILE_DEPTH][TILE_COLUMNS + 1];
  float sums[ITEM_CELLS][ITEM_CELLS];
  tile_product(o, i0, n, j0, 0, depth, a_tile, b_tile, sums);
  for (int r = 0; r < ITEM_CELLS; ++r) {
    for (int c = 0; c < ITEM_CELLS; ++c) {
      const int i = i0 + get_local_id(1) * ITEM_CELLS + r;
      const int j = j0 + c * ITEM_SIDE + get_local_id(0);
      if (i < n && j < m) out[(size_t)i * m + j] = sums[r][c] + offset[j];
    }
  }
#endif
}
