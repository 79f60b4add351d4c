// The scatter of blocks of curves about a shift: out[block] = sum over the block's curves of (y - shift)(y - shift)',
// lower half; and the column sums of y - shift. Curves are rows of `stride` points, padded to a multiple of 64, as is
// the shift.

typedef struct {
  __global const float* curves;
  __global const float* shift;
  int stride;
} Operands;

inline float a_value(Operands o, int i, int k) {
  return o.curves[(size_t)k * o.stride + i] - o.shift[i];
}
inline float4 a_values(Operands o, int i, int k) {
  return vload4(0, o.curves + (size_t)k * o.stride + i) - vload4(0, o.shift + i);
}
inline float b_value(Operands o, int k, int j) {
  return o.curves[(size_t)k * o.stride + j] - o.shift[j];
}
inline float16 b_values(Operands o, int k, int j) {
  return vload16(0, o.curves + (size_t)k * o.stride + j) - vload16(0, o.shift + j);
}

#define A_ROWS_APART 0
#include "matrix_tile.cl"

#if WITH_LANES
__kernel
    __attribute__((reqd_work_group_size(1, 1, 1)))
#else
__kernel
    __attribute__((reqd_work_group_size(ITEM_SIDE, ITEM_SIDE, 1)))
#endif
    void
    block_scatter(__global const float* restrict curves, __global const float* restrict shift, int count, int block,
                  int stride, __global float* restrict all_out) {
  const Operands o = {curves, shift, stride};
  const int j0 = get_group_id(0) * TILE_COLUMNS;
  const int i0 = get_group_id(1) * TILE_ROWS;
  const int b = get_group_id(2);
  if (j0 >= i0 + TILE_ROWS) return;  // above the diagonal
  const int end = min((b + 1) * block, count);
  __global float* out = all_out + (size_t)b * stride * stride;
#if WITH_LANES
  float16 sums[TILE_ROWS][2];
  tile_product(o, i0, stride, j0, b * block, end, sums);
  for (int r = 0; r < TILE_ROWS; ++r) {
    for (int v = 0; v < 2; ++v) vstore16(sums[r][v], 0, out + (size_t)(i0 + r) * stride + j0 + 16 * v);
  }
#else
  __local float a_tile[TILE_DEPTH][TILE_ROWS + 1];
  __local float b_tile[TILE_DEPTH][TILE_COLUMNS + 1];
  float sums[ITEM_CELLS][ITEM_CELLS];
  tile_product(o, i0, stride, j0, b * block, end, a_tile, b_tile, sums);
  for (int r = 0; r < ITEM_CELLS; ++r) {
    for (int c = 0; c < ITEM_CELLS; ++c) {
      out[(size_t)(i0 + get_local_id(1) * ITEM_CELLS + r) * stride + j0 + c * ITEM_SIDE + get_local_id(0)] = sums[r][c];
    }
  }
#endif
}

// One item: sixteen points of one block. Sums of 64 curves at a time, so that rounding does not grow with the block.
__kernel void block_sums(__global const float* restrict curves, __global const float* restrict shift, int count,
                         int block, int stride, __global float* restrict out) {
  const int j = get_global_id(0) * 16;
  const int b = get_global_id(1);
  const int end = min((b + 1) * block, count);
  const float16 about = vload16(0, shift + j);
  float16 total = 0;
  for (int first = b * block; first < end; first += 64) {
    float16 sum = 0;
    for (int k = first; k < min(first + 64, end); ++k) sum += vload16(0, curves + (size_t)k * stride + j) - about;
    total += sum;
  }
  vstore16(total, 0, out + (size_t)b * stride + j);
}
