// A skeleton as a body of capsules, and what of it is drawn besides.
import type { SkeletonData } from "./data.ts";
import type { Vector } from "./matrix.ts";
import type { Capsules, Colour } from "./renderer.ts";

export interface Bone {
  from: number; // points of a pose: joints, then end sites
  to: number;
  radius: number;
  side: "body" | "left" | "right";
}

export interface Body {
  bones: Bone[];
  head: { from: number; to: number; radius: number } | undefined;
  trails: number[]; // joints whose way is drawn
  joints: number;
}

// By the names that people and programs give joints: LeftArm, Arm_L, l_arm, and those of the CMU's skeletons.
function sideOf(name: string): Bone["side"] {
  const cmu = /^([lr])(hipjoint|femur|tibia|foot|toes|clavicle|humerus|radius|wrist|hand|fingers|thumb)$/.exec(name)?.[1];
  const found = cmu ?? /left|right/i.exec(name)?.[0] ?? /(?:^|[_.:\- ])([lr])(?:[_.:\- ]|$)/i.exec(name)?.[1];
  if (!found) return "body";
  return found[0]!.toLowerCase() === "l" ? "left" : "right";
}

export function bodyOf(skeleton: SkeletonData): Body {
  const { joints, height } = skeleton;
  const children = joints.map(() => 0);
  for (const joint of joints) if (joint.parent >= 0) ++children[joint.parent]!;
  // What lies above the root that moves is no limb.
  const root = skeleton.rotating[0] ?? 0;
  const above = new Set<number>();
  for (let j = joints[root]!.parent; j >= 0; j = joints[j]!.parent) above.add(j);
  const bones: Bone[] = [];
  const bone = (from: number, to: number, length: number, name: string) => {
    if (length < height * 0.004) return;
    const side = sideOf(name);
    const torso = side === "body" && !/neck|head/i.test(name);
    const [share, most] = torso ? [0.55, 0.047] : [0.17, 0.03];
    const radius = Math.min(Math.max(length * share, height * 0.009), height * most);
    bones.push({ from, to, radius, side });
  };
  joints.forEach((joint, j) => {
    if (joint.parent >= 0 && !above.has(joint.parent)) bone(joint.parent, j, Math.hypot(...joint.offset), joint.name);
  });
  let end = joints.length;
  const headJoint = joints.findIndex((joint) => /^(.*[^a-z])?head/i.test(joint.name));
  let head: Body["head"];
  joints.forEach((joint, j) => {
    if (!joint.end) return;
    if (j === headJoint) head = { from: j, to: end, radius: height * 0.052 };
    else bone(j, end, Math.hypot(...joint.end), joint.name);
    ++end;
  });
  if (!head && headJoint >= 0) head = { from: headJoint, to: headJoint, radius: height * 0.052 };
  const named = joints.flatMap((joint, j) => (/(hand|wrist|foot|ankle)$/i.test(joint.name) ? [j] : []));
  const leaves = joints.flatMap((_, j) => (children[j] === 0 ? [j] : []));
  return { bones, head, trails: named.length >= 2 ? named : leaves.slice(0, 6), joints: joints.length };
}

export function pointOf(positions: Float32Array, points: number, frame: number, point: number): Vector {
  const at = (frame * points + point) * 3;
  return [positions[at]!, positions[at + 1]!, positions[at + 2]!];
}

// Between two frames: straight lines.
export function pointAt(positions: Float32Array, points: number, frame: number, point: number): Vector {
  const last = positions.length / (points * 3) - 1;
  const i = Math.min(Math.floor(frame), last);
  const b = frame - i;
  const a = pointOf(positions, points, i, point);
  if (b <= 0 || i >= last) return a;
  const c = pointOf(positions, points, i + 1, point);
  return [a[0] + b * (c[0] - a[0]), a[1] + b * (c[1] - a[1]), a[2] + b * (c[2] - a[2])];
}

export type BodyColours = Record<Bone["side"], Colour>;

// `points`: how many a frame of the positions has; without the end sites there are no bones to them.
export function addBody(body: Body, positions: Float32Array, points: number, frame: number, colours: BodyColours, out: Capsules, thinner = 1): void {
  const places: Vector[] = [];
  for (let p = 0; p < points; ++p) places.push(pointAt(positions, points, frame, p));
  for (const bone of body.bones) {
    const from = places[bone.from];
    const to = places[bone.to];
    if (!from || !to) continue;
    const radius = bone.radius * thinner;
    out.add(from, to, radius, radius * 0.82, colours[bone.side]);
  }
  if (!body.head) return;
  const from = places[body.head.from];
  if (!from) return;
  const to = places[body.head.to] ?? from;
  const mid: Vector = [from[0] * 0.45 + to[0] * 0.55, from[1] * 0.45 + to[1] * 0.55, from[2] * 0.45 + to[2] * 0.55];
  const radius = body.head.radius * thinner;
  const along = (k: number): Vector => [mid[0] + (from[0] - to[0]) * k, mid[1] + (from[1] - to[1]) * k, mid[2] + (from[2] - to[2]) * k];
  out.add(along(0.12), along(-0.12), radius * 0.92, radius, colours.body);
}
