// Batched DTW for GPUs: one work-group of 64 items matches one pair of clips.
//
// The table is walked in tiles of 64 x 64 cells. The group sums a tile's distances like a matrix product (8 x 8 cells
// an item, features staged in local memory), then sweeps it along anti-diagonals, item t owning row t of the tile; only
// the last row of a strip of tiles goes through global memory. Build options: SLOPE_LIMITED and WANT_PATH, 0 or 1.

#define SIDE 64   // cells of a tile, items of a group
#define BLOCK 8   // cells of an item in the distances
#define DEPTH 16  // features staged at a time

// As dtw_opencl.cpp fills them.
typedef struct {
  ulong border;  // in float2
  ulong steps;   // in uint
  int query_row;
  int target_row;
  int n;
  int m;
  int band;  // bound of |i (m-1) - j (n-1)|
  int unused;
} Job;

inline bool in_band(Job job, int i, int j) {
  const int off = i * (job.m - 1) - j * (job.n - 1);
  return abs(off) <= (uint)job.band;
}

// The distances of a tile into `tile`, whose rows are SIDE + 1 apart.
inline void tile_distances(__global const float* restrict queries, __global const float* restrict targets, int dims,
                           int stride, Job job, int i0, int j0, int squared, __local float* restrict a,
                           __local float* restrict b, __local float* restrict tile) {
  const int item = get_local_id(0);
  const int rows = item / BLOCK;
  const int frames = item % BLOCK;
  float sums[BLOCK][BLOCK];
  for (int r = 0; r < BLOCK; ++r) {
    for (int c = 0; c < BLOCK; ++c) sums[r][c] = 0;
  }
  for (int k0 = 0; k0 < dims; k0 += DEPTH) {
    for (int e = item; e < SIDE * DEPTH; e += SIDE) {
      const int row = e / DEPTH;
      const int k = e % DEPTH;
      a[k * (SIDE + 1) + row] = queries[(size_t)(job.query_row + min(i0 + row, job.n - 1)) * stride + k0 + k];
      b[k * (SIDE + 1) + row] = targets[(size_t)(job.target_row + min(j0 + row, job.m - 1)) * stride + k0 + k];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int k = 0; k < min(DEPTH, dims - k0); ++k) {
      for (int r = 0; r < BLOCK; ++r) {
        const float q = a[k * (SIDE + 1) + rows * BLOCK + r];
        for (int c = 0; c < BLOCK; ++c) {
          const float difference = b[k * (SIDE + 1) + c * BLOCK + frames] - q;
          sums[r][c] = fma(difference, difference, sums[r][c]);
        }
      }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  for (int r = 0; r < BLOCK; ++r) {
    for (int c = 0; c < BLOCK; ++c) {
      tile[(rows * BLOCK + r) * (SIDE + 1) + c * BLOCK + frames] = squared ? sums[r][c] : sqrt(sums[r][c]);
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
}

__kernel __attribute__((reqd_work_group_size(SIDE, 1, 1))) void dtw_groups(
    __global const float* restrict queries, __global const float* restrict targets, int dims, int stride,
    __global const Job* restrict jobs, int banded, int squared, int prefer_query, __global float2* restrict borders,
    __global uint* restrict all_steps, __global float* restrict costs) {
  __local float a[DEPTH * (SIDE + 1)];
  __local float b[DEPTH * (SIDE + 1)];
  __local float tile[SIDE * (SIDE + 1)];
  __local float2 passed[2][SIDE];  // what each row gives to the row below: D, and what a straight step may start from
  const Job job = jobs[get_group_id(0)];
  __global float2* restrict border = borders + job.border;  // the last row of the strip above
  const int item = get_local_id(0);
  const int words = (job.m + 15) / 16;
  for (int i0 = 0; i0 < job.n; i0 += SIDE) {
    const int i = i0 + item;
    float left = INFINITY;  // what a straight step along the row may start from
    float corner = i == 0 ? 0.0f : INFINITY;
    for (int j0 = 0; j0 < job.m; j0 += SIDE) {
      tile_distances(queries, targets, dims, stride, job, i0, j0, squared, a, b, tile);
      uint codes = 0;
      for (int s = 0; s < 2 * SIDE - 1; ++s) {
        const int c = s - item;
        const int j = j0 + c;
        if (c >= 0 && c < SIDE && j < job.m && i < job.n) {
          float2 above = (float2)(INFINITY);
          if (item > 0) {
            above = passed[(s + 1) & 1][item - 1];
          } else if (i0 > 0) {
            above = border[j];
          }
          const float up = above.y;
          const float straight = left < up ? left : up;
          float d = tile[item * (SIDE + 1) + c];
          if (banded && !in_band(job, i, j)) d = INFINITY;
          const float cell = d + (corner < straight ? corner : straight);
#if WANT_PATH
          const bool is_up = prefer_query ? up <= left : up < left;
          const uint code = corner > straight ? (is_up ? 2u : 1u) : 0u;
          codes |= code << (2 * (c & 15));
          if ((c & 15) == 15 || j == job.m - 1) {
            all_steps[job.steps + (ulong)i * words + j / 16] = codes;
            codes = 0;
          }
#endif
#if SLOPE_LIMITED
          left = d + corner;
#else
          left = cell;
#endif
          corner = above.x;
          passed[s & 1][item] = (float2)(cell, left);
          if (item == SIDE - 1) border[j] = (float2)(cell, left);
          if (i == job.n - 1 && j == job.m - 1) costs[get_group_id(0)] = cell;
        }
        barrier(CLK_LOCAL_MEM_FENCE);
      }
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
}
