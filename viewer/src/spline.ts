// Interpolating cubic splines over the grid 0, 1, .., n - 1 with not-a-knot ends, many curves at once:
// motion/uniform_spline.h.

export class UniformSpline {
  private readonly second: Float64Array;

  // values: [sample][curve]
  constructor(
    readonly values: Float64Array,
    readonly samples: number,
    readonly curves: number,
  ) {
    this.second = secondDerivatives(values, samples, curves);
  }

  // Of the first `count` curves at x, which is clamped to the grid.
  value(x: number, out: Float64Array, at = 0, count = this.curves): void {
    const { values, second, curves, samples } = this;
    if (samples === 1) {
      for (let c = 0; c < count; ++c) out[at + c] = values[c]!;
      return;
    }
    const clamped = Math.min(Math.max(x, 0), samples - 1);
    const cell = Math.min(Math.floor(clamped), samples - 2);
    const b = clamped - cell;
    const a = 1 - b;
    const ca = (a * a * a - a) / 6;
    const cb = (b * b * b - b) / 6;
    const i = cell * curves;
    const j = i + curves;
    for (let c = 0; c < count; ++c) {
      out[at + c] = a * values[i + c]! + b * values[j + c]! + ca * second[i + c]! + cb * second[j + c]!;
    }
  }

  // From 0 to each grid point: [sample][curve].
  cumulativeIntegral(): Float64Array {
    const { values, second, curves, samples } = this;
    const sum = new Float64Array(values.length);
    for (let i = 0; i + 1 < samples; ++i) {
      for (let c = 0; c < curves; ++c) {
        const a = i * curves + c;
        const b = a + curves;
        sum[b] = sum[a]! + (values[a]! + values[b]!) / 2 - (second[a]! + second[b]!) / 24;
      }
    }
    return sum;
  }
}

function secondDerivatives(y: Float64Array, n: number, curves: number): Float64Array {
  const m = new Float64Array(y.length);
  if (n < 3) return m;
  const bend = (i: number, c: number) => y[(i - 1) * curves + c]! - 2 * y[i * curves + c]! + y[(i + 1) * curves + c]!;
  if (n === 3) {
    for (let c = 0; c < curves; ++c) m[c] = m[curves + c] = m[2 * curves + c] = bend(1, c);
    return m;
  }
  const inner = n - 2;
  const upper = new Float64Array(inner);
  for (let c = 0; c < curves; ++c) m[curves + c] = bend(1, c);
  for (let i = 2; i <= inner; ++i) {
    const last = i === inner;
    const lower = last ? 0 : 1;
    const pivot = (last ? 6 : 4) - lower * upper[i - 2]!;
    upper[i - 1] = last ? 0 : 1 / pivot;
    for (let c = 0; c < curves; ++c) m[i * curves + c] = (6 * bend(i, c) - lower * m[(i - 1) * curves + c]!) / pivot;
  }
  for (let i = inner - 1; i >= 1; --i) {
    for (let c = 0; c < curves; ++c) m[i * curves + c]! -= upper[i - 1]! * m[(i + 1) * curves + c]!;
  }
  for (let c = 0; c < curves; ++c) {
    m[c] = 2 * m[curves + c]! - m[2 * curves + c]!;
    m[(n - 1) * curves + c] = 2 * m[(n - 2) * curves + c]! - m[(n - 3) * curves + c]!;
  }
  return m;
}
