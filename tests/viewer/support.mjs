// What the tests of the page share: a library of sample clips made once, the command, the page's data, and a BVH reader
// that knows nothing of the page.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const build = process.env.KINESPACE_BUILD;
export const root = process.env.KINESPACE_ROOT;
// Made by run.mjs for all test files.
export const work = process.env.KINESPACE_WORK;
export const library = join(work, "sample.kspace");

export function kinespace(...args) {
  return execFileSync(join(build, "kinespace"), args, { cwd: work, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

// What the command says when it refuses.
export function refused(...args) {
  try {
    kinespace(...args);
  } catch (error) {
    return { code: error.status, said: error.stderr };
  }
  throw new Error(`kinespace ${args.join(" ")} was not refused`);
}

export function makeWork() {
  const folder = mkdtempSync(join(tmpdir(), "kinespace-viewer-"));
  mkdirSync(join(folder, "unpacked"));
  return { folder, remove: () => rmSync(folder, { recursive: true, force: true }) };
}

// The JSON blocks of a page: { overview, motions: Map(place, data) }.
export function dataOf(page) {
  const text = readFileSync(page, "utf8");
  const motions = new Map();
  let overview;
  for (const [, id, json] of text.matchAll(/<script type="application\/json" id="([a-z]+(?:-\d+)?)">([^<]*)<\/script>/g)) {
    if (id === "overview") overview = JSON.parse(json);
    else motions.set(Number(id.slice("motion-".length)), JSON.parse(json));
  }
  return { text, overview, motions };
}

const axes = { X: [1, 0, 0], Y: [0, 1, 0], Z: [0, 0, 1] };

function rotation(axis, degrees) {
  const half = (degrees * Math.PI) / 360;
  const [x, y, z] = axes[axis].map((v) => v * Math.sin(half));
  return [Math.cos(half), x, y, z];
}

function product([a, b, c, d], [w, x, y, z]) {
  return [
    a * w - b * x - c * y - d * z,
    a * x + b * w + c * z - d * y,
    a * y - b * z + c * w + d * x,
    a * z + b * y - c * x + d * w,
  ];
}

function turned(q, v) {
  const [, x, y, z] = product(product(q, [0, ...v]), [q[0], -q[1], -q[2], -q[3]]);
  return [x, y, z];
}

// World positions of the joints of a BVH file: { names, frames: [frame][joint][x y z] }.
export function readBvh(file) {
  const words = readFileSync(file, "utf8").trim().split(/\s+/);
  const joints = [];
  const open = [];
  let at = 0;
  let pending;
  for (; words[at] !== "MOTION"; ++at) {
    const word = words[at];
    if (word === "ROOT" || word === "JOINT") {
      pending = joints.length;
      joints.push({ name: words[++at], parent: open.at(-1) ?? -1, channels: [] });
    } else if (word === "End") {
      pending = -1;
      ++at;
    } else if (word === "{") {
      open.push(pending);
    } else if (word === "}") {
      open.pop();
    } else if (word === "OFFSET") {
      const offset = words.slice(at + 1, at + 4).map(Number);
      if (open.at(-1) >= 0) joints[open.at(-1)].offset = offset;
      at += 3;
    } else if (word === "CHANNELS") {
      const count = Number(words[at + 1]);
      joints[open.at(-1)].channels = words.slice(at + 2, at + 2 + count);
      at += 1 + count;
    }
  }
  const count = Number(words[at + 2]);
  at += 6; // MOTION Frames: N Frame Time: T
  const frames = [];
  for (let f = 0; f < count; ++f) {
    const places = [];
    const turns = [];
    for (const joint of joints) {
      let translation = [...joint.offset];
      let q = [1, 0, 0, 0];
      for (const channel of joint.channels) {
        const value = Number(words[at++]);
        if (channel.endsWith("position")) translation["XYZ".indexOf(channel[0])] = value;
        else q = product(q, rotation(channel[0], value));
      }
      const parent = joint.parent;
      places.push(parent < 0 ? translation : turned(turns[parent], translation).map((v, k) => v + places[parent][k]));
      turns.push(parent < 0 ? q : product(turns[parent], q));
    }
    frames.push(places);
  }
  return { names: joints.map((joint) => joint.name), frames };
}

export function haveFile(file) {
  return existsSync(file);
}
