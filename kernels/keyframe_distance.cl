// Distances between all rows of a and all rows of b: sqrt(|a|^2 + |b|^2 - 2 a.b), clamped at 0. b comes turned,
// [feature] [row], its rows padded with zeros to a multiple of 64.

typedef struct {
  __global const float* a;
  __global const float* b;
  int dims;
  int b_stride;
} Operands;

inline float a_value(Operands o, int i, int k) {
  return o.a[(size_t)i * o.dims + k];
}
inline float b_value(Operands o, int k, int j) {
  return o.b[(size_t)k * o.b_stride + j];
}
inline float16 b_values(Operands o, int k, int j) {
  return vload16(0, o.b + (size_t)k * o.b_stride + j);
}

#define A_ROWS_APART 1  // neighbours in k are neighbours in memory
#include "matrix_tile.cl"

#if WITH_LANES
__kernel
    __attribute__((reqd_work_group_size(1, 1, 1)))
#else
__kernel
    __attribute__((reqd_work_group_size(ITEM_SIDE, ITEM_SIDE, 1)))
#endif
    void
    keyframe_distance(__global const float* restrict a, __global const float* restrict b, int n, int m, int dims,
                      int b_stride, __global const float* restrict a_norms, __global const float* restrict b_norms,
                      int squared, __global float* restrict out) {
  const Operands o = {a, b, dims, b_stride};
  const int j0 = get_group_id(0) * TILE_COLUMNS;
  const int i0 = get_group_id(1) * TILE_ROWS;
#if WITH_LANES
  float16 sums[TILE_ROWS][2];
  tile_product(o, i0, n, j0, 0, dims, sums);
  for (int r = 0; r < TILE_ROWS && i0 + r < n; ++r) {
    for (int v = 0; v < 2; ++v) {
      const int j = j0 + 16 * v;
      const float16 square = fmax(a_norms[i0 + r] + vload16(0, b_norms + j) - 2 * sums[r][v], 0.0f);
      store_part(squared ? square : sqrt(square), m - j, out + (size_t)(i0 + r) * m + j);
    }
  }
#else
  __local float a_tile[TILE_DEPTH][TILE_ROWS + 1];
  __local float b_tile[TILE_DEPTH][TILE_COLUMNS + 1];
  float sums[ITEM_CELLS][ITEM_CELLS];
  tile_product(o, i0, n, j0, 0, dims, a_tile, b_tile, sums);
  for (int r = 0; r < ITEM_CELLS; ++r) {
    for (int c = 0; c < ITEM_CELLS; ++c) {
      const int i = i0 + get_local_id(1) * ITEM_CELLS + r;
      const int j = j0 + c * ITEM_SIDE + get_local_id(0);
      if (i < n && j < m) {
        const float square = fmax(a_norms[i] + b_norms[j] - 2 * sums[r][c], 0.0f);
        out[(size_t)i * m + j] = squared ? square : sqrt(square);
      }
    }
  }
#endif
}
