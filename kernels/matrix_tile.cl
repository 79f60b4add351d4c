// The product of two matrices in tiles, for kernels that differ in where the factors come from and what becomes of the
// sums. Who includes this defines the type Operands and
//
//   float a_value(Operands o, int i, int k)      row i of the first factor; i within the matrix
//   float4 a_values(Operands o, int i, int k)    rows i .. i + 3, where A_ROWS_APART is 0: rows lie side by side in
//                                                memory
//   float b_value(Operands o, int k, int j)      column j of the second; j up to the next multiple of TILE_COLUMNS
//   float16 b_values(Operands o, int k, int j)   columns j .. j + 15
//
// Build option: WITH_LANES 1 for processors (one item a group; a tile of sums in float16 registers), 0 for GPUs (256
// items a group, 4 x 4 sums each, factors staged in local memory).

#if WITH_LANES

#define TILE_ROWS 4
#define TILE_COLUMNS 32

// sums[r][v]: row first_row + r (`rows` of the matrix: those past the end repeat the last), columns
// first_column + 16 v + lane.
inline void tile_product(Operands o, int first_row, int rows, int first_column, int first, int end,
                         float16 sums[TILE_ROWS][2]) {
  int row[TILE_ROWS];
#pragma unroll
  for (int r = 0; r < TILE_ROWS; ++r) {
    row[r] = min(first_row + r, rows - 1);
    sums[r][0] = sums[r][1] = 0;
  }
  for (int k = first; k < end; ++k) {
    const float16 b0 = b_values(o, k, first_column);
    const float16 b1 = b_values(o, k, first_column + 16);
#if A_ROWS_APART
    const float4 a =
        (float4)(a_value(o, row[0], k), a_value(o, row[1], k), a_value(o, row[2], k), a_value(o, row[3], k));
#else
    const float4 a = a_values(o, first_row, k);
#endif
    sums[0][0] = fma(a.s0, b0, sums[0][0]);
    sums[0][1] = fma(a.s0, b1, sums[0][1]);
    sums[1][0] = fma(a.s1, b0, sums[1][0]);
    sums[1][1] = fma(a.s1, b1, sums[1][1]);
    sums[2][0] = fma(a.s2, b0, sums[2][0]);
    sums[2][1] = fma(a.s2, b1, sums[2][1]);
    sums[3][0] = fma(a.s3, b0, sums[3][0]);
    sums[3][1] = fma(a.s3, b1, sums[3][1]);
  }
}

inline void store_part(float16 values, int count, __global float* to) {
  if (count >= 16) {
    vstore16(values, 0, to);
  } else {
    float parts[16];
    vstore16(values, 0, parts);
    for (int l = 0; l < count; ++l) to[l] = parts[l];
  }
}

#else

#define TILE_ROWS 64
#define TILE_COLUMNS 64
#define ITEM_SIDE 16  // items of a group in each direction
#define ITEM_CELLS 4  // sums of an item in each direction
#define TILE_DEPTH 16

// sums[r][c]: row first_row + ITEM_CELLS * y + r, column first_column + ITEM_SIDE * c + x of item (x, y).
inline void tile_product(Operands o, int first_row, int rows, int first_column, int first, int end,
                         __local float a[TILE_DEPTH][TILE_ROWS + 1], __local float b[TILE_DEPTH][TILE_COLUMNS + 1],
                         float sums[ITEM_CELLS][ITEM_CELLS]) {
  const int x = get_local_id(0);
  const int y = get_local_id(1);
  for (int r = 0; r < ITEM_CELLS; ++r) {
    for (int c = 0; c < ITEM_CELLS; ++c) sums[r][c] = 0;
  }
  for (int k0 = first; k0 < end; k0 += TILE_DEPTH) {
    for (int e = y * ITEM_SIDE + x; e < TILE_DEPTH * TILE_ROWS; e += ITEM_SIDE * ITEM_SIDE) {
      const int k = A_ROWS_APART ? e % TILE_DEPTH : e / TILE_ROWS;
      const int row = A_ROWS_APART ? e / TILE_DEPTH : e % TILE_ROWS;
      a[k][row] = k0 + k < end ? a_value(o, min(first_row + row, rows - 1), k0 + k) : 0;
    }
    for (int e = y * ITEM_SIDE + x; e < TILE_DEPTH * TILE_COLUMNS; e += ITEM_SIDE * ITEM_SIDE) {
      const int k = e / TILE_COLUMNS;
      const int column = e % TILE_COLUMNS;
      b[k][column] = k0 + k < end ? b_value(o, k0 + k, first_column + column) : 0;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int k = 0; k < TILE_DEPTH; ++k) {
      for (int r = 0; r < ITEM_CELLS; ++r) {
        for (int c = 0; c < ITEM_CELLS; ++c) {
          sums[r][c] = fma(a[k][y * ITEM_CELLS + r], b[k][c * ITEM_SIDE + x], sums[r][c]);
        }
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif
