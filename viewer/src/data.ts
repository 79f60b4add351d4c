// What `kinespace view` puts into the page (cli/view_data.cpp), and how its blocks of numbers are read.
//
// Units: centimetres, seconds, radians; travel in metres; Y up; quaternions w x y z.

export interface GroupData {
  mean: string; // floats [point]
  functions: string; // floats [function][point]
  eigenvalues: number[]; // descending
  variance: number; // of the curves, over all directions
}

// Functions for sequences of one kind (docs/files.md, "Function sets").
export interface SetData {
  cycles: number; // whole ones that a sequence holds; 0: cut at rests
  points: number;
  rows: number; // of scores: functions, and two ends where the space is pinned
  pace: number; // numbers a curve that one more level takes
  groups: GroupData[];
}

export interface SpaceData {
  pinned: boolean;
  curves: number;
  levels: number; // the level of detail that has all functions
  variance: number; // share that functions cover
  movement: number; // the same of each curve's about its own mean
  groups: number[]; // of each curve
  sets: (SetData | null)[]; // by cycles
  map_shares: [number, number]; // of the variance of the clips' vectors along the axes of the map
}

export interface JointData {
  name: string;
  parent: number; // -1: the first
  offset: [number, number, number];
  end: [number, number, number] | null;
}

export interface SkeletonData {
  joints: JointData[];
  rotating: number[]; // joints with a rotation curve, the travel root first
  height: number;
}

export interface ClipData {
  name: string;
  labels: string[];
  space: number;
  skeleton: number;
  frames: number;
  rate: number;
  x: number; // on the map
  y: number;
}

export interface LevelData {
  functions: number;
  mean_joint_error_cm: number;
  max_joint_error_cm: number;
  worst_clip: string;
}

export interface Overview {
  library: string;
  first: number | null; // the clip that plays when the page opens; null: the first that is in it
  spaces: SpaceData[];
  skeletons: SkeletonData[];
  levels: LevelData[]; // over all clips, of the levels that were measured
  clips: ClipData[];
}

export interface SequenceData {
  first: number;
  last: number;
  cycles: number;
  extra: number; // how much more detail it takes, sixteenths
  warp: number[]; // five coefficients, 1/64
  travel: number[]; // metres
  rows: number; // of its scores that are not 0
}

export interface MotionData {
  start: number[];
  heading: number;
  runs: { start: number[]; sequences: SequenceData[] }[];
  side_tracks: { joint: number; dimensions: number; frames: number[]; values: string }[];
  // Steps of 1e-4 / sqrt(pace), zigzag varints: [sequence][row][curve]. Row 0 of a pinned sequence that is not the first
  // of its run is row 1 of the one before and left out.
  scores: string;
  levels: [level: number, mean: number, max: number][]; // measured errors, cm
  feet: { joints: number[]; contacts: [slot: number, first: number, last: number][] } | null;
  nearest: [clip: number, distance: number, vectorDistance: number][] | null; // null: not looked for
  original: string | null; // steps of 0.01 cm, varints: [joint][axis][frame], second differences over the frames
}

export function bytesOf(base64: string): Uint8Array {
  const text = atob(base64);
  const out = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) out[i] = text.charCodeAt(i);
  return out;
}

export function floatsOf(base64: string): Float64Array {
  const bytes = bytesOf(base64);
  const view = new DataView(bytes.buffer);
  const out = new Float64Array(bytes.length / 4);
  for (let i = 0; i < out.length; ++i) out[i] = view.getFloat32(4 * i, true);
  return out;
}

// Whole numbers as zigzag varints, one after the other.
export class SignedNumbers {
  private at = 0;
  constructor(private readonly bytes: Uint8Array) {}

  next(): number {
    let value = 0;
    let scale = 1;
    for (;;) {
      const byte = this.bytes[this.at++];
      if (byte === undefined) throw new Error("a block of numbers ends early");
      value += (byte & 127) * scale;
      if (byte < 128) break;
      scale *= 128;
    }
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  }

  done(): boolean {
    return this.at === this.bytes.length;
  }
}
