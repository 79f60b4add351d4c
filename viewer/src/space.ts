// The functions of a motion space, as the page plays them (fpca/motion_space.h).
import { floatsOf, type SetData, type SpaceData } from "./data.ts";
import { UniformSpline } from "./spline.ts";

const ends = 2; // rows of scores before those of functions, in a pinned space

export interface FunctionGroup {
  mean: Float64Array;
  functions: Float64Array; // [function][point]
  count: number;
  eigenvalues: number[];
  variance: number;
  spline: UniformSpline; // through the functions: [point][function]
}

export class FunctionSet {
  readonly points: number;
  readonly rows: number;
  readonly pace: number;
  readonly groups: FunctionGroup[];

  constructor(
    data: SetData,
    readonly pinned: boolean,
    private readonly groupOf: number[],
  ) {
    this.points = data.points;
    this.rows = data.rows;
    this.pace = data.pace;
    this.groups = data.groups.map((group) => {
      const functions = floatsOf(group.functions);
      const count = group.eigenvalues.length;
      const byPoint = new Float64Array(functions.length);
      for (let k = 0; k < count; ++k) {
        for (let i = 0; i < data.points; ++i) byPoint[i * count + k] = functions[k * data.points + i]!;
      }
      const spline = new UniformSpline(byPoint, data.points, count);
      return { mean: floatsOf(group.mean), functions, count, eigenvalues: group.eigenvalues, variance: group.variance, spline };
    });
  }

  get ends(): number {
    return this.pinned ? ends : 0;
  }

  // Rows of scores that a level of detail takes; all when it is negative.
  rowsAt(level: number): number {
    if (level < 0) return this.rows;
    const numbers = Math.ceil(level * this.pace - 1e-9);
    return Math.min(this.rows, this.pinned ? Math.max(ends, numbers + 1) : numbers);
  }

  // [point][curve] of scores [row][curve], of which there are `rows`: those behind are 0.
  samples(scores: Float64Array, rows: number, curves: number, level: number): Float64Array {
    const kept = this.rowsAt(level);
    const out = new Float64Array(this.points * curves);
    const functions = Math.max(0, Math.min(kept, rows) - this.ends);
    for (let c = 0; c < curves; ++c) {
      const group = this.groups[this.groupOf[c]!]!;
      for (let i = 0; i < this.points; ++i) out[i * curves + c] = group.mean[i]!;
      for (let k = 0; k < Math.min(functions, group.count); ++k) {
        const score = scores[(k + this.ends) * curves + c]!;
        if (score === 0) continue;
        const from = k * this.points;
        for (let i = 0; i < this.points; ++i) out[i * curves + c]! += score * group.functions[from + i]!;
      }
    }
    if (this.pinned && kept > 0) this.addEnds(scores, curves, out);
    return out;
  }

  // What functions from a level on would add at a place of the grid, by curve; 0 for the root's travel (fpca/left_out.h).
  leftOut(scores: Float64Array, rows: number, curves: number, x: number, level: number): Float64Array {
    const out = new Float64Array(curves);
    const from = Math.max(this.rowsAt(level), ends);
    if (rows <= from) return out;
    const values = this.groups.map((group) => {
      const at = new Float64Array(group.count);
      group.spline.value(x, at);
      return at;
    });
    for (let row = from; row < rows; ++row) {
      for (let c = 3; c < curves; ++c) {
        const value = values[this.groupOf[c]!]![row - ends];
        if (value !== undefined) out[c]! += value * scores[row * curves + c]!;
      }
    }
    return out;
  }

  private addEnds(scores: Float64Array, curves: number, samples: Float64Array): void {
    for (let i = 0; i < this.points; ++i) {
      const s = i / (this.points - 1);
      for (let c = 0; c < curves; ++c) {
        samples[i * curves + c]! += (1 - s) * scores[c]! + s * scores[curves + c]!;
      }
    }
  }
}

export class Space {
  readonly curves: number;
  readonly levels: number;
  readonly pinned: boolean;
  private readonly made: (FunctionSet | undefined)[] = [];

  constructor(readonly data: SpaceData) {
    this.curves = data.curves;
    this.levels = data.levels;
    this.pinned = data.pinned;
  }

  // Of sequences of so many whole cycles.
  set(cycles: number): FunctionSet {
    const known = this.made[cycles];
    if (known) return known;
    const data = this.data.sets[cycles];
    if (!data) throw new Error(`no functions for sequences of ${cycles} cycles`);
    return (this.made[cycles] = new FunctionSet(data, this.pinned, this.data.groups));
  }

  kinds(): number[] {
    return this.data.sets.flatMap((set, cycles) => (set ? [cycles] : []));
  }
}
