// Local linear smoothing on regular grids, as local_linear.cpp does it. Build options: REAL double or float; WIDTH 16
// for processors (a work-item computes sixteen neighbours) or 1 for GPUs; KERNEL 0 epanechnikov, 1 quartic, 2 gauss.
// Rows of out_points are `stride` apart, padded with zeros to a multiple of sixteen.

#ifdef WITH_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif

#if WIDTH == 1
typedef REAL vec;
#define LOAD(from) (*(from))
#define STORE(values, to) (*(to) = (values))
#else
#define JOIN(a, b) a##b
#define VECTOR(type) JOIN(type, 16)
typedef VECTOR(REAL) vec;
#define LOAD(from) vload16(0, from)
#define STORE(values, to) vstore16(values, 0, to)
#endif

// half(c, i) = sum over k of surface(k, c) weight(k, i): smoothed along one direction. `surface` by columns.
__kernel void smooth_columns(__global const REAL* restrict surface, __global const REAL* restrict weight,
                             __global const int2* restrict bands, int points, int out_points, int stride,
                             __global REAL* restrict half_smoothed) {
  const int i = get_global_id(0) * WIDTH;
  const int c = get_global_id(1);
  const int last = min(i + WIDTH, out_points) - 1;
  vec sum = 0;
  for (int k = bands[i].x; k < bands[last].y; ++k)
    sum += surface[(size_t)c * points + k] * LOAD(weight + (size_t)k * stride + i);
  STORE(sum, half_smoothed + (size_t)c * stride + i);
}

// sum(i, j) = sum over k of weight(k, i) half(k, j), and the same with weight_u.
__kernel void smooth_rows(__global const REAL* restrict half_smoothed, __global const REAL* restrict weight,
                          __global const REAL* restrict weight_u, __global const int2* restrict bands, int stride,
                          __global REAL* restrict sum, __global REAL* restrict sum_u) {
  const int j = get_global_id(0) * WIDTH;
  const int i = get_global_id(1);
  vec total = 0;
  vec total_u = 0;
  for (int k = bands[i].x; k < bands[i].y; ++k) {
    const vec values = LOAD(half_smoothed + (size_t)k * stride + j);
    total += weight[(size_t)k * stride + i] * values;
    total_u += weight_u[(size_t)k * stride + i] * values;
  }
  STORE(total, sum + (size_t)i * stride + j);
  STORE(total_u, sum_u + (size_t)i * stride + j);
}

// The estimate at (i, j), i >= j, and its mirror image.
__kernel void combine(__global const REAL* restrict sum, __global const REAL* restrict sum_u,
                      __global const REAL* restrict constant_share, __global const REAL* restrict slope_share,
                      int out_points, int stride, __global REAL* restrict out) {
  const int j = get_global_id(0);
  const int i = get_global_id(1);
  if (j > i) return;
  const int here = i * stride + j;
  const int mirror = j * stride + i;
  const int share = i * out_points + j;
  const int share_mirror = j * out_points + i;
  const REAL value = constant_share[share] * (REAL)(0.5f) * (sum[here] + sum[mirror]) +
                     slope_share[share] * sum_u[here] + slope_share[share_mirror] * sum_u[mirror];
  out[share] = value;
  out[share_mirror] = value;
}

inline vec kernel_value(vec u) {
  const vec inside = 1 - u * u;
#if KERNEL == 0
  return fmax(inside, (vec)(0)) * (REAL)(0.75f);
#elif KERNEL == 1
  const vec positive = fmax(inside, (vec)(0));
  return positive * positive * (REAL)(0.9375f);
#else
  return exp(u * u * (REAL)(-0.5f));  // the scale cancels
#endif
}

// The fit of {1, x - x0} at sixteen x0, and how far its normal equations are from singular: det / (s0 s2). `at` is
// padded.
__kernel void local_line(__global const REAL* restrict values, __global const REAL* restrict weights,
                         __global const REAL* restrict at, int points, REAL bandwidth, __global REAL* restrict out,
                         __global REAL* restrict regularity) {
  const int i = get_global_id(0) * WIDTH;
  const vec x0 = LOAD(at + i);
  vec s0 = 0;
  vec s1 = 0;
  vec s2 = 0;
  vec r0 = 0;
  vec r1 = 0;
  for (int k = 0; k < points; ++k) {
    const vec u = ((REAL)(k) / (REAL)(points - 1) - x0) / bandwidth;
    const vec w = kernel_value(u) * weights[k];
    s0 += w;
    s1 += w * u;
    s2 += w * u * u;
    r0 += w * values[k];
    r1 += w * u * values[k];
  }
  const vec det = s0 * s2 - s1 * s1;
  STORE((s2 * r0 - s1 * r1) / det, out + i);
  STORE(det / (s0 * s2), regularity + i);
}
