// The library in the page: clips are read when they are looked at, and their last levels kept.
import { Motion, Space, type ClipData, type MotionData, type Overview } from "./motion.ts";
import { bodyOf, pointOf, type Body } from "./body.ts";
import type { Vector } from "./matrix.ts";

const mostKept = 48; // clips

export class PlayedClip {
  readonly motion: Motion;
  readonly body: Body;
  readonly ground: number; // the lowest that a joint comes with all functions
  readonly height: number;
  readonly original: Float32Array | undefined;
  private readonly root: Float32Array; // its way, smoothed: [frame][x z]
  private readonly levels = new Map<number, Float32Array>();

  constructor(
    readonly index: number,
    readonly clip: ClipData,
    data: MotionData,
    space: Space,
    overview: Overview,
  ) {
    const skeleton = overview.skeletons[clip.skeleton]!;
    this.motion = new Motion(data, clip, space, skeleton);
    this.body = bodyOf(skeleton);
    this.height = skeleton.height || 170;
    this.original = this.motion.originalPositions();
    const all = this.positions(-1);
    let lowest = Infinity;
    for (let i = 1; i < all.length; i += 3) lowest = Math.min(lowest, all[i]!);
    this.ground = lowest;
    this.root = smoothedWay(all, this.motion.points, skeleton.rotating[0] ?? 0, clip.frames, Math.round(clip.rate * 0.45));
  }

  get duration(): number {
    return (this.clip.frames - 1) / this.clip.rate;
  }

  get points(): number {
    return this.motion.points;
  }

  positions(level: number): Float32Array {
    const of = level >= this.motion.space.levels ? -1 : level;
    const known = this.levels.get(of);
    if (known) return known;
    const made = this.motion.positions(of);
    if (this.levels.size >= 6) this.levels.delete([...this.levels.keys()].find((k) => k !== -1) ?? of);
    this.levels.set(of, made);
    return made;
  }

  // Where the body is, for a camera that goes with it.
  target(frame: number): Vector {
    const i = Math.min(Math.floor(frame), this.clip.frames - 1);
    const j = Math.min(i + 1, this.clip.frames - 1);
    const b = frame - i;
    const at = (k: number) => this.root[i * 2 + k]! * (1 - b) + this.root[j * 2 + k]! * b;
    return [at(0), this.ground + this.height * 0.5, at(1)];
  }

  // The middle of the whole way, and how far the body goes from it.
  extent(): { centre: Vector; reach: number } {
    let [lowX, highX, lowZ, highZ] = [Infinity, -Infinity, Infinity, -Infinity];
    for (let f = 0; f < this.clip.frames; ++f) {
      lowX = Math.min(lowX, this.root[f * 2]!);
      highX = Math.max(highX, this.root[f * 2]!);
      lowZ = Math.min(lowZ, this.root[f * 2 + 1]!);
      highZ = Math.max(highZ, this.root[f * 2 + 1]!);
    }
    const centre: Vector = [(lowX + highX) / 2, this.ground + this.height * 0.5, (lowZ + highZ) / 2];
    return { centre, reach: Math.hypot(highX - lowX, highZ - lowZ) / 2 };
  }
}

function smoothedWay(positions: Float32Array, points: number, root: number, frames: number, half: number): Float32Array {
  const sums = new Float64Array((frames + 1) * 2);
  for (let f = 0; f < frames; ++f) {
    const p = pointOf(positions, points, f, root);
    sums[f * 2 + 2] = sums[f * 2]! + p[0];
    sums[f * 2 + 3] = sums[f * 2 + 1]! + p[2];
  }
  const out = new Float32Array(frames * 2);
  for (let f = 0; f < frames; ++f) {
    const reach = Math.min(half, f, frames - 1 - f);
    for (let k = 0; k < 2; ++k) {
      out[f * 2 + k] = (sums[(f + reach + 1) * 2 + k]! - sums[(f - reach) * 2 + k]!) / (2 * reach + 1);
    }
  }
  return out;
}

export class PageLibrary {
  readonly overview: Overview;
  readonly spaces: Space[];
  private readonly kept = new Map<number, PlayedClip>();

  constructor(private readonly page: Document) {
    const text = page.getElementById("overview")?.textContent;
    if (!text) throw new Error("the page holds no library: `kinespace view LIB` fills it");
    this.overview = JSON.parse(text) as Overview;
    this.spaces = this.overview.spaces.map((space) => new Space(space));
  }

  // Whether the clip's motion is in the page.
  plays(index: number): boolean {
    return this.page.getElementById(`motion-${index}`) !== null;
  }

  playable(): number[] {
    return this.overview.clips.flatMap((_, i) => (this.plays(i) ? [i] : []));
  }

  motion(index: number): PlayedClip | undefined {
    const known = this.kept.get(index);
    if (known) return known;
    const text = this.page.getElementById(`motion-${index}`)?.textContent;
    const clip = this.overview.clips[index];
    if (!text || !clip) return undefined;
    const made = new PlayedClip(index, clip, JSON.parse(text) as MotionData, this.spaces[clip.space]!, this.overview);
    if (this.kept.size >= mostKept) this.kept.delete(this.kept.keys().next().value!);
    this.kept.set(index, made);
    return made;
  }
}
