// A clip of a library at any level of detail: from scores to curves to joint positions, as fpca/encoding.h and
// motion/curves.h have it. tests/viewer holds it to `kinespace export`.
import { bytesOf, floatsOf, SignedNumbers, type ClipData, type MotionData, type SkeletonData } from "./data.ts";
import { Space } from "./space.ts";
import { UniformSpline } from "./spline.ts";

export { Space } from "./space.ts";
export * from "./data.ts";

const blend = 0.13; // of a sequence, within which corrections at a cut fade
const freeChange = 0.3; // of the typical change of slope that may stay at a cut, where ends are not kept

interface Sequence {
  first: number;
  last: number;
  cycles: number;
  extra: number;
  warp: Warp;
  travel: number[];
  rows: number;
  scores: Float64Array; // [row][curve]
}

interface SideTrack {
  joint: number;
  dimensions: number;
  frames: number[];
  values: Float64Array;
}

// Time in the space to a sequence's own time, both over [0, 1] (fpca/warp.h).
class Warp {
  private readonly identity: boolean;
  constructor(private readonly coefficients: number[]) {
    this.identity = coefficients.every((a) => a === 0);
  }
  ownTime(s: number): number {
    let sum = s;
    this.coefficients.forEach((a, k) => {
      const w = (k + 1) * Math.PI;
      sum += (a * Math.sin(w * s)) / (w * 64);
    });
    return sum;
  }
  slope(s: number): number {
    let sum = 1;
    this.coefficients.forEach((a, k) => (sum += (a * Math.cos((k + 1) * Math.PI * s)) / 64));
    return sum;
  }
  spaceTime(u: number): number {
    if (u <= 0) return 0;
    if (u >= 1) return 1;
    if (this.identity) return u;
    let low = 0;
    let high = 1;
    let s = u;
    for (let i = 0; i < 60; ++i) {
      const error = this.ownTime(s) - u;
      if (Math.abs(error) < 1e-14) break;
      if (error > 0) high = s;
      else low = s;
      const next = s - error / this.slope(s);
      s = next > low && next < high ? next : (low + high) / 2;
    }
    return s;
  }
}

export class Motion {
  readonly frames: number;
  readonly rate: number;
  private readonly runs: { start: number[]; sequences: Sequence[] }[];
  private readonly sideTracks: SideTrack[];

  constructor(
    readonly data: MotionData,
    clip: ClipData,
    readonly space: Space,
    readonly skeleton: SkeletonData,
  ) {
    this.frames = clip.frames;
    this.rate = clip.rate;
    this.runs = readRuns(data, space);
    this.sideTracks = data.side_tracks.map((track) => ({ ...track, values: floatsOf(track.values) }));
  }

  // How many whole numbers the level of detail takes of this clip.
  numbersAt(level: number): number {
    let sum = 0;
    for (const run of this.runs) {
      run.sequences.forEach((s, i) => {
        const set = this.space.set(s.cycles);
        const shared = i > 0 && set.pinned ? 1 : 0;
        sum += (Math.min(s.rows, set.rowsAt(levelOf(s, level))) - shared) * this.space.curves;
      });
    }
    return sum;
  }

  // The kind of most of its sequences: whole cycles that one holds.
  mostlyCycles(): number {
    const seconds = new Map<number, number>();
    for (const run of this.runs) {
      for (const s of run.sequences) seconds.set(s.cycles, (seconds.get(s.cycles) ?? 0) + s.last - s.first);
    }
    return [...seconds].sort((a, b) => b[1] - a[1])[0]?.[0] ?? 0;
  }

  cuts(): number[] {
    return this.runs.flatMap((run) => run.sequences.map((s) => s.first));
  }

  // [frame][curve]: the root's place in metres from the start, in the frame of its heading there, and quaternions.
  // All functions when the level is negative.
  curves(level: number): Float64Array {
    const width = this.space.curves;
    const out = new Float64Array(this.frames * width);
    for (const run of this.runs) {
      const start = [...run.start];
      let next: Float64Array | undefined;
      let before: Correction | undefined;
      run.sequences.forEach((sequence, i) => {
        const frames = next ?? this.sequenceFrames(sequence, start, level);
        for (let k = 0; k < 3; ++k) start[k]! += sequence.travel[k]!;
        const following = run.sequences[i + 1];
        let after: Correction | undefined;
        next = undefined;
        if (following) {
          next = this.sequenceFrames(following, start, level);
          after = cutCorrection(frames, next, width);
          if (this.space.pinned) this.giveSlopes(sequence, following, level, after);
        }
        join(frames, width, before, after);
        out.set(following ? frames.subarray(0, frames.length - width) : frames, sequence.first * width);
        before = after;
      });
    }
    return out;
  }

  // World positions, cm: [frame][joint, then end sites in the order of their joints][x y z].
  positions(level: number): Float32Array {
    return worldPositions(this.curves(level), this);
  }

  get ends(): number[] {
    return this.skeleton.joints.flatMap((joint, j) => (joint.end ? [j] : []));
  }

  get points(): number {
    return this.skeleton.joints.length + this.ends.length;
  }

  // [frame][joint][x y z] of the file that the clip came from; undefined where it is not in the page.
  originalPositions(): Float32Array | undefined {
    if (this.data.original === null) return undefined;
    const numbers = new SignedNumbers(bytesOf(this.data.original));
    const joints = this.skeleton.joints.length;
    const out = new Float32Array(this.frames * joints * 3);
    for (let k = 0; k < joints * 3; ++k) {
      let last = 0;
      let slope = 0;
      for (let f = 0; f < this.frames; ++f) {
        const here = last + slope + numbers.next();
        slope = f === 0 ? 0 : here - last;
        last = here;
        out[f * joints * 3 + k] = here / 100;
      }
    }
    return out;
  }

  sideTrack(joint: number, dimensions: number): SideTrack | undefined {
    return this.sideTracks.find((track) => track.joint === joint && track.dimensions === dimensions);
  }

  private sequenceFrames(sequence: Sequence, start: number[], level: number): Float64Array {
    const set = this.space.set(sequence.cycles);
    const width = this.space.curves;
    const samples = set.samples(sequence.scores, sequence.rows, width, levelOf(sequence, level));
    const intervals = sequence.last - sequence.first;
    integrateTravel(samples, set.points, width, sequence.warp, intervals / this.rate);
    const spline = new UniformSpline(samples, set.points, width);
    const out = new Float64Array((intervals + 1) * width);
    for (let f = 0; f <= intervals; ++f) {
      const u = intervals === 0 ? 0 : f / intervals;
      spline.value(sequence.warp.spaceTime(u) * (set.points - 1), out, f * width);
    }
    // What the functions left out of the way is spread evenly.
    const missing = [0, 1, 2].map((k) => sequence.travel[k]! - out[intervals * width + k]!);
    for (let f = 0; f <= intervals; ++f) {
      const u = intervals === 0 ? 0 : f / intervals;
      for (let k = 0; k < 3; ++k) out[f * width + k]! += start[k]! + u * missing[k]!;
    }
    return out;
  }

  private giveSlopes(before: Sequence, after: Sequence, level: number, correction: Correction): void {
    const slope = (sequence: Sequence, ownTime: number): Float64Array => {
      const set = this.space.set(sequence.cycles);
      const x = sequence.warp.spaceTime(ownTime) * (set.points - 1);
      const of = levelOf(sequence, level);
      return set.leftOut(sequence.scores, sequence.rows, this.space.curves, x, of).map((v) => -v);
    };
    const framesBefore = before.last - before.first;
    const framesAfter = after.last - after.first;
    const known = level >= 0 && framesBefore >= 1 && framesAfter >= 1;
    correction.slopeBefore = known ? slope(before, 1 - 1 / framesBefore) : new Float64Array(this.space.curves);
    correction.slopeAfter = known ? slope(after, 1 / framesAfter) : new Float64Array(this.space.curves);
  }
}

// The level of its set that a sequence has at one of the clip.
function levelOf(sequence: Sequence, level: number): number {
  return level <= 0 ? level : level + Math.floor((level * sequence.extra + 15) / 16);
}

function readRuns(data: MotionData, space: Space): { start: number[]; sequences: Sequence[] }[] {
  const numbers = new SignedNumbers(bytesOf(data.scores));
  const width = space.curves;
  const runs = data.runs.map((run) => {
    const sequences: Sequence[] = [];
    for (const s of run.sequences) {
      const set = space.set(s.cycles);
      const before = sequences.at(-1);
      const rows = Math.max(s.rows, set.ends);
      const scores = new Float64Array(rows * width);
      let from = 0;
      if (before && set.pinned) {
        scores.set(before.scores.subarray(width, 2 * width));
        from = 1;
      }
      const step = 1e-4 / Math.sqrt(set.pace);
      for (let i = from * width; i < s.rows * width; ++i) scores[i] = numbers.next() * step;
      sequences.push({ ...s, rows, scores, warp: new Warp(s.warp) });
    }
    return { start: run.start, sequences };
  });
  if (!numbers.done()) throw new Error("a clip has more scores than its sequences take");
  return runs;
}

// The velocity in columns 0 .. 2 becomes the way from the start, over own time.
function integrateTravel(samples: Float64Array, points: number, width: number, warp: Warp, duration: number): void {
  const step = 1 / (points - 1);
  const rate = new Float64Array(points * 3);
  for (let i = 0; i < points; ++i) {
    const scale = warp.slope(i * step) * duration * step;
    for (let k = 0; k < 3; ++k) rate[i * 3 + k] = samples[i * width + k]! * scale;
  }
  const way = new UniformSpline(rate, points, 3).cumulativeIntegral();
  for (let i = 0; i < points; ++i) {
    for (let k = 0; k < 3; ++k) samples[i * width + k] = way[i * 3 + k]!;
  }
}

// fpca/cut_join.h
interface Correction {
  value: Float64Array;
  slopeBefore: Float64Array;
  slopeAfter: Float64Array;
}

function fade(x: number): { value: number; slope: number } {
  const u = 1 - x / blend;
  if (u <= 0) return { value: 0, slope: 0 };
  const u3 = u * u * u;
  return { value: u3 * (10 - 15 * u + 6 * u * u), slope: (1 - u) * u3 * (1 + 3 * (1 - u)) };
}

function typicalChange(frames: Float64Array, width: number): Float64Array {
  const out = new Float64Array(width);
  const count = frames.length / width - 2;
  if (count < 1) return out;
  for (let f = 0; f < count; ++f) {
    for (let c = 0; c < width; ++c) {
      const i = f * width + c;
      const change = frames[i]! - 2 * frames[i + width]! + frames[i + 2 * width]!;
      out[c]! += change * change;
    }
  }
  return out.map((sum) => Math.sqrt(sum / count));
}

function cutCorrection(left: Float64Array, right: Float64Array, width: number): Correction {
  const end = left.length - width;
  const value = new Float64Array(width);
  const slope = new Float64Array(width);
  for (let c = 0; c < width; ++c) value[c] = (right[c]! - left[end + c]!) / 2;
  if (end >= width && right.length >= 2 * width) {
    const a = typicalChange(left, width);
    const b = typicalChange(right, width);
    for (let c = 0; c < width; ++c) {
      const change = right[width + c]! - right[c]! - (left[end + c]! - left[end - width + c]!);
      const allowed = (freeChange * (a[c]! + b[c]!)) / 2;
      slope[c] = (Math.max(Math.abs(change) - allowed, 0) * Math.sign(change)) / 2;
    }
  }
  return { value, slopeBefore: slope, slopeAfter: slope };
}

function join(frames: Float64Array, width: number, before: Correction | undefined, after: Correction | undefined): void {
  const intervals = frames.length / width - 1;
  const first = intervals > 0 ? fade(1 / intervals).slope : 0;
  const steepness = first > 0 ? 1 / first : 0;
  for (let f = 0; f <= intervals; ++f) {
    if (before) {
      const w = fade(f / intervals);
      for (let c = 0; c < width; ++c) {
        frames[f * width + c]! += -w.value * before.value[c]! - w.slope * steepness * before.slopeAfter[c]!;
      }
    }
    if (after) {
      const w = fade((intervals - f) / intervals);
      for (let c = 0; c < width; ++c) {
        frames[f * width + c]! += w.value * after.value[c]! - w.slope * steepness * after.slopeBefore[c]!;
      }
    }
  }
}

type Quaternion = [w: number, x: number, y: number, z: number];
type Vector = [x: number, y: number, z: number];

function product(a: Quaternion, b: Quaternion): Quaternion {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
    a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
  ];
}

function unit(w: number, x: number, y: number, z: number): Quaternion {
  const length = Math.sqrt(w * w + x * x + y * y + z * z) || 1;
  return [w / length, x / length, y / length, z / length];
}

// from + q v
function moved(from: Vector, q: Quaternion, v: readonly number[]): Vector {
  const [w, x, y, z] = q;
  const [a, b, c] = [v[0]!, v[1]!, v[2]!];
  const ux = 2 * (y * c - z * b);
  const uy = 2 * (z * a - x * c);
  const uz = 2 * (x * b - y * a);
  return [
    from[0] + a + w * ux + (y * uz - z * uy),
    from[1] + b + w * uy + (z * ux - x * uz),
    from[2] + c + w * uz + (x * uy - y * ux),
  ];
}

// At a frame: linear between knots.
function interpolated(track: SideTrack, frame: number): number[] {
  const { frames, values, dimensions: d } = track;
  let piece = 0;
  let high = frames.length - 1;
  while (piece < high) {
    const middle = (piece + high + 1) >> 1;
    if (frames[middle]! <= frame) piece = middle;
    else high = middle - 1;
  }
  const here = Array.from(values.subarray(piece * d, piece * d + d));
  if (piece + 1 >= frames.length) return here;
  const b = (frame - frames[piece]!) / (frames[piece + 1]! - frames[piece]!);
  return here.map((v, k) => (1 - b) * v + b * values[(piece + 1) * d + k]!);
}

function worldPositions(curves: Float64Array, motion: Motion): Float32Array {
  const { joints, rotating } = motion.skeleton;
  const width = motion.space.curves;
  const root = rotating[0]!;
  const curveOf = new Map(rotating.map((joint, k) => [joint, 3 + 4 * k]));
  const translations = joints.map((_, j) => motion.sideTrack(j, 3));
  const rotations = joints.map((_, j) => motion.sideTrack(j, 4));
  const half = motion.data.heading / 2;
  const turn: Quaternion = [Math.cos(half), 0, Math.sin(half), 0];
  const startCm = motion.data.start as unknown as Vector;
  const out = new Float32Array(motion.frames * motion.points * 3);
  const places: Vector[] = joints.map(() => [0, 0, 0]);
  const turns: Quaternion[] = joints.map(() => [1, 0, 0, 0]);
  let at = 0;
  const put = (v: Vector) => {
    out[at++] = v[0];
    out[at++] = v[1];
    out[at++] = v[2];
  };
  for (let f = 0; f < motion.frames; ++f) {
    const row = f * width;
    const quaternion = (curve: number): Quaternion =>
      unit(curves[row + curve]!, curves[row + curve + 1]!, curves[row + curve + 2]!, curves[row + curve + 3]!);
    joints.forEach((joint, j) => {
      if (j === root) {
        places[j] = moved(startCm, turn, [curves[row]! * 100, curves[row + 1]! * 100, curves[row + 2]! * 100]);
        turns[j] = product(turn, quaternion(3));
      } else {
        const parent = joint.parent;
        const translation = translations[j] ? interpolated(translations[j], f) : joint.offset;
        const curve = curveOf.get(j);
        let local: Quaternion = [1, 0, 0, 0];
        if (curve !== undefined) local = quaternion(curve);
        else if (rotations[j]) local = unit(...(interpolated(rotations[j], f) as Quaternion));
        places[j] = parent < 0 ? moved([0, 0, 0], [1, 0, 0, 0], translation) : moved(places[parent]!, turns[parent]!, translation);
        turns[j] = parent < 0 ? local : product(turns[parent]!, local);
      }
      put(places[j]);
    });
    joints.forEach((joint, j) => {
      if (joint.end) put(moved(places[j]!, turns[j]!, joint.end));
    });
  }
  return out;
}
