// Batched DTW for processors: one work-item a group matches one query clip with sixteen target clips, one in each lane.
//
// Four target frames are interleaved over the lanes and stay in the first cache while all query rows pass over them,
// four at a time: 4 x 4 distances are summed in registers and the recurrence follows in the same loop. Build options:
// SLOPE_LIMITED and WANT_PATH, 0 or 1. The host gives for each tile of four frames the query rows that have legal
// cells.

#define LANES 16
#define ROWS 4
#define FRAMES 4
#define SMALLER(a, b) ((a) < (b) ? (a) : (b))

// As dtw_opencl.cpp fills them.
typedef struct {
  ulong scratch;  // in float16
  ulong steps;    // in uint16
  int query_row;
  int rows;
  int tiles;
  int ranges;  // index of the first TileRange
} Job;

typedef struct {
  int first;  // query rows, a multiple of ROWS
  int end;
  int steps;  // from the job's first, in uint16
} TileRange;

typedef struct {
  int first_row[LANES];
  int rows[LANES];
  int band[LANES];  // bound of |i (m-1) - j (n-1)|
} Lanes;

// Sixteen features of sixteen rows, turned: four perfect shuffles transpose a 16 x 16 matrix.
inline void transpose(float16* rows) {
  float16 turned[LANES];
#pragma unroll
  for (int pass = 0; pass < 4; ++pass) {
#pragma unroll
    for (int l = 0; l < LANES / 2; ++l) {
      const float16 a = rows[l];
      const float16 b = rows[l + LANES / 2];
      turned[2 * l] =
          (float16)(a.s0, b.s0, a.s1, b.s1, a.s2, b.s2, a.s3, b.s3, a.s4, b.s4, a.s5, b.s5, a.s6, b.s6, a.s7, b.s7);
      turned[2 * l + 1] =
          (float16)(a.s8, b.s8, a.s9, b.s9, a.sa, b.sa, a.sb, b.sb, a.sc, b.sc, a.sd, b.sd, a.se, b.se, a.sf, b.sf);
    }
#pragma unroll
    for (int l = 0; l < LANES; ++l) rows[l] = turned[l];
  }
}

// FRAMES frames of every lane's target from frame j on, as [feature][frame][lane]; the last frame stands in after the
// end.
inline void load_tile(__global const float* restrict targets, __global const Lanes* restrict lanes, int stride, int j,
                      __global float16* restrict tile) {
  for (int c = 0; c < FRAMES; ++c) {
    for (int k = 0; k < stride; k += LANES) {
      float16 rows[LANES];
#pragma unroll
      for (int l = 0; l < LANES; ++l) {
        const int frame = min(j + c, lanes->rows[l] - 1);
        rows[l] = vload16(0, targets + (size_t)(lanes->first_row[l] + frame) * stride + k);
      }
      transpose(rows);
#pragma unroll
      for (int l = 0; l < LANES; ++l) tile[(k + l) * FRAMES + c] = rows[l];
    }
  }
}

__kernel __attribute__((reqd_work_group_size(1, 1, 1))) void dtw_lanes(
    __global const float* restrict queries, __global const float* restrict targets, int dims, int stride,
    __global const Job* restrict jobs, __global const TileRange* restrict ranges,
    __global const Lanes* restrict all_lanes, int banded, int squared, int prefer_query,
    __global float16* restrict scratch, __global uint16* restrict all_steps, __global float16* restrict costs) {
  const Job job = jobs[get_global_id(0)];
  __global const Lanes* restrict lanes = all_lanes + get_global_id(0);
  __global const float* query = queries + (size_t)job.query_row * stride;
  const int n = job.rows;
  __global float16* restrict tile = scratch + job.scratch;
  // The last column that was computed: D, and what a straight step may start from.
  __global float16* restrict column = tile + FRAMES * stride;
#if SLOPE_LIMITED
  __global float16* restrict straight_column = column + n + ROWS;
#endif
  const int16 m = vload16(0, lanes->rows);
  const int16 band = vload16(0, lanes->band);
  for (int i = 0; i < n + ROWS; ++i) {
    column[i] = INFINITY;
#if SLOPE_LIMITED
    straight_column[i] = INFINITY;
#endif
  }
  float16 result = INFINITY;
  int first_before = 0;
  for (int t = 0; t < job.tiles; ++t) {
    const int j0 = t * FRAMES;
    const TileRange range = ranges[job.ranges + t];
    load_tile(targets, lanes, stride, j0, tile);
    float16 top[FRAMES];           // D of the row above
    float16 straight_top[FRAMES];  // and what a straight step may start from
#pragma unroll
    for (int c = 0; c < FRAMES; ++c) top[c] = straight_top[c] = INFINITY;
    // Column j0 - 1 of the row above, where that was computed for this column and not for an earlier one.
    float16 corner_below = t == 0 ? (float16)(0) : (float16)(INFINITY);
    if (range.first > first_before) corner_below = column[range.first - 1];
    first_before = range.first;
#if WANT_PATH
    __global uint16* restrict steps = all_steps + job.steps + range.steps;
#endif
    for (int i0 = range.first; i0 < range.end; i0 += ROWS) {
      float16 sums[ROWS][FRAMES];
      __global const float* row[ROWS];
#pragma unroll
      for (int r = 0; r < ROWS; ++r) {
        row[r] = query + (size_t)min(i0 + r, n - 1) * stride;
#pragma unroll
        for (int c = 0; c < FRAMES; ++c) sums[r][c] = 0;
      }
      for (int k = 0; k < dims; ++k) {
#pragma unroll
        for (int c = 0; c < FRAMES; ++c) {
          const float16 b = tile[k * FRAMES + c];
#pragma unroll
          for (int r = 0; r < ROWS; ++r) {
            const float16 difference = b - row[r][k];
            sums[r][c] = fma(difference, difference, sums[r][c]);
          }
        }
      }
#if WANT_PATH
      uint16 codes = 0;
#endif
#pragma unroll
      for (int r = 0; r < ROWS; ++r) {
        const int i = i0 + r;
        float16 corner = corner_below;
        corner_below = column[i];
#if SLOPE_LIMITED
        float16 left = straight_column[i];
#else
        float16 left = corner_below;
#endif
        float16 cell = INFINITY;
#pragma unroll
        for (int c = 0; c < FRAMES; ++c) {
          const float16 up = straight_top[c];
          const float16 straight = SMALLER(left, up);
          float16 d = squared ? sums[r][c] : sqrt(sums[r][c]);
          if (banded) {
            const int16 off = i * (m - 1) - (j0 + c) * (n - 1);
            d = abs(off) <= as_uint16(band) ? d : (float16)(INFINITY);
          }
#if WANT_PATH
          const int16 is_straight = corner > straight;
          const int16 is_up = prefer_query ? up <= left : up < left;
          const uint16 code = is_up ? (uint16)(2) : (uint16)(1);
          codes |= (is_straight ? code : (uint16)(0)) << (uint16)(2 * (r * FRAMES + c));
#endif
          cell = d + SMALLER(corner, straight);
#if SLOPE_LIMITED
          left = d + corner;
#else
          left = cell;
#endif
          corner = top[c];
          top[c] = cell;
          straight_top[c] = left;
        }
        column[i] = cell;
#if SLOPE_LIMITED
        straight_column[i] = left;
#endif
        if (i == n - 1) {
#pragma unroll
          for (int c = 0; c < FRAMES; ++c) result = m - 1 == j0 + c ? top[c] : result;
        }
      }
#if WANT_PATH
      steps[(i0 - range.first) / ROWS] = codes;
#endif
    }
  }
  costs[get_global_id(0)] = result;
}
