// The page's reader of motion gives what `kinespace export` gives: the same numbers, read by another program.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { build, dataOf, haveFile, kinespace, library, readBvh, work } from "./support.mjs";

const { Motion, Space } = await import(pathToFileURL(join(build, "viewer", "motion.mjs")));
const tolerance = 1e-3; // cm

// The largest distance of a joint of the page from that of the export, cm.
function compare(page, from, clipName, level) {
  const { overview, motions } = dataOf(page);
  const at = overview.clips.findIndex((clip) => clip.name === clipName);
  assert.ok(motions.has(at), `${clipName} is in the page`);
  const clip = overview.clips[at];
  const space = new Space(overview.spaces[clip.space]);
  const motion = new Motion(motions.get(at), clip, space, overview.skeletons[clip.skeleton]);
  const file = join(work, "unpacked", "again.bvh");
  const options = level < 0 ? [] : ["--lod", String(level)];
  kinespace("export", from, clipName, "-o", file, "--no-plant-feet", "--quiet", ...options);
  const expected = readBvh(file);
  const found = motion.positions(level);
  assert.equal(expected.frames.length, clip.frames);
  assert.deepEqual(expected.names, overview.skeletons[clip.skeleton].joints.map((joint) => joint.name));
  let most = 0;
  expected.frames.forEach((joints, f) =>
    joints.forEach((place, j) => {
      const o = (f * motion.points + j) * 3;
      most = Math.max(most, Math.hypot(...place.map((v, k) => v - found[o + k])));
    }),
  );
  return most;
}

function pageOf(from, name, ...options) {
  const page = join(work, `${name}.html`);
  kinespace("view", from, "-o", page, "--nearest", "0", "--quiet", ...options);
  return page;
}

test("the reference that the page is held to finds a difference", () => {
  const page = pageOf(library, "decode");
  assert.ok(compare(page, library, "run_fast_002", 5) <= tolerance);
  const { overview, motions } = dataOf(page);
  const at = overview.clips.findIndex((clip) => clip.name === "run_fast_002");
  const space = new Space(overview.spaces[0]);
  const motion = new Motion(motions.get(at), overview.clips[at], space, overview.skeletons[0]);
  const [five, all] = [motion.positions(5), motion.positions(-1)];
  assert.ok(Math.max(...five.map((v, i) => Math.abs(v - all[i]))) > 0.5, "five functions are not all functions");
});

for (const level of [1, 5, -1]) {
  test(`sample clips at ${level < 0 ? "all" : level} functions are those of export`, () => {
    const page = join(work, "decode.html");
    if (!haveFile(page)) pageOf(library, "decode");
    for (const name of ["walk_fast_002", "jump_forward_001", "turn_left_002"]) {
      const most = compare(page, library, name, level);
      assert.ok(most <= tolerance, `${name} at ${level}: ${most} cm`);
    }
  });
}

test("every other way in which a library can keep motion", () => {
  const kinds = {
    component: ["--grouping", "component"], // functions by component of a curve
    smooth: ["--smooth", "--grouping", "component"], // the ends of sequences are not kept apart
  };
  for (const [name, options] of Object.entries(kinds)) {
    const file = join(work, `${name}.kspace`);
    kinespace("build", join(work, "few"), "-o", file, "--quiet", ...options);
    const page = pageOf(file, name);
    assert.equal(dataOf(page).overview.spaces[0].pinned, name !== "smooth");
    for (const clip of dataOf(page).overview.clips) {
      for (const level of [2, 5]) {
        const most = compare(page, file, clip.name, level);
        assert.ok(most <= tolerance, `${name}: ${clip.name} at ${level}: ${most} cm`);
      }
    }
  }
});

const data = process.env.KINESPACE_DATA ?? join(process.env.KINESPACE_ROOT, "build", "data");
const real = ["bandai1/dash_active_001.bvh", "bandai1/bow_active_001.bvh"].map((file) => join(data, file)).filter(haveFile);
test("recordings", { skip: real.length === 0 && "no recordings here" }, () => {
  const file = join(work, "real.kspace");
  kinespace("build", ...real, "-o", file, "--quiet");
  const page = pageOf(file, "real");
  for (const clip of dataOf(page).overview.clips) {
    for (const level of [5, -1]) {
      const most = compare(page, file, clip.name, level);
      assert.ok(most <= tolerance, `${clip.name} at ${level}: ${most} cm`);
    }
  }
});
