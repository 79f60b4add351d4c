// What the command puts into a page, and what it says of it.
import assert from "node:assert/strict";
import { readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { dataOf, haveFile, kinespace, library, refused, work } from "./support.mjs";

test("the nearest of every clip are those of query, in its order", () => {
  const page = join(work, "nearest.html");
  kinespace("view", library, "-o", page, "--nearest", "4", "--quiet");
  const { overview, motions } = dataOf(page);
  assert.equal(motions.size, overview.clips.length);
  for (const [at, motion] of [...motions].filter(([place]) => place % 3 === 0)) {
    const { matches } = JSON.parse(kinespace("query", library, overview.clips[at].name, "-k", "4", "--json"));
    assert.equal(matches.length, 4);
    assert.deepEqual(motion.nearest.map(([clip]) => overview.clips[clip].name), matches.map((match) => match.clip));
    motion.nearest.forEach(([, distance, vector], i) => {
      assert.ok(Math.abs(distance - matches[i].distance) < 1e-9);
      assert.ok(Math.abs(vector - matches[i].vector_distance) < 1e-9);
    });
  }
});

test("levels, clips and labels are those of info", () => {
  const { overview } = dataOf(join(work, "nearest.html"));
  const info = JSON.parse(kinespace("info", library, "--json"));
  assert.deepEqual(overview.levels, info.levels);
  assert.deepEqual(overview.clips.map(({ name, labels, frames }) => ({ name, labels, frames })), info.clip_list.map(({ name, labels, frames }) => ({ name, labels, frames })));
});

test("named clips and the nearest of each play, and the others are on the map", () => {
  const page = join(work, "named.html");
  const said = JSON.parse(kinespace("view", library, "wave_left_001", "-o", page, "--nearest", "1", "--json", "--quiet"));
  const { overview, motions } = dataOf(page);
  assert.equal(overview.clips[overview.first].name, "wave_left_001");
  assert.equal(motions.size, 2);
  assert.equal(said.shown, 2);
  assert.equal(said.clips, overview.clips.length);
  assert.equal(said.bytes, statSync(page).size);
  for (const key of ["output", "clips", "shown", "with_nearest", "with_original", "bytes"]) assert.ok(key in said, key);
});

test("a page keeps to --max-size, takes clips from all of the list, and says what is left out", () => {
  const whole = dataOf(join(work, "nearest.html"));
  const overviewSize = JSON.stringify(whole.overview).length;
  const megabytes = (overviewSize + [...whole.motions.values()].reduce((sum, m) => sum + JSON.stringify(m).length, 0) / 2) / 1e6;
  const page = join(work, "small.html");
  kinespace("view", library, "-o", page, "--nearest", "0", "--max-size", megabytes.toFixed(4), "--quiet");
  const { motions, overview } = dataOf(page);
  assert.ok(motions.size >= 2 && motions.size < overview.clips.length, `${motions.size} clips`);
  assert.ok(Math.max(...motions.keys()) > overview.clips.length / 2 && motions.has(0), "clips from both halves of the list");
  assert.equal(overview.clips.length, whole.overview.clips.length);
  const { code, said } = refused("view", library, "-o", page, "--max-size", "0.01");
  assert.equal(code, 2);
  assert.match(said, /--max-size/);
  const none = refused("view", library, "-o", page, "--nearest", "0", "--max-size", ((overviewSize + 500) / 1e6).toFixed(4));
  assert.equal(none.code, 2);
  assert.match(none.said, /a single clip/);
  const clip = refused("view", library, "walk_fast_001", "-o", page, "--nearest", "0", "--max-size", ((overviewSize + 500) / 1e6).toFixed(4));
  assert.equal(clip.code, 2);
  assert.match(clip.said, /walk_fast_001/);
});

test("the originals are those of the files, to the steps they are kept in", async () => {
  const page = join(work, "originals.html");
  const said = JSON.parse(kinespace("view", library, "run_fast_001", "-o", page, "--nearest", "0", "--originals", "--json"));
  assert.equal(said.with_original, 1);
  const { Motion, Space } = await import(join(process.env.KINESPACE_BUILD, "viewer", "motion.mjs"));
  const { readBvh } = await import("./support.mjs");
  const { overview, motions } = dataOf(page);
  const clip = overview.clips[overview.first];
  const motion = new Motion(motions.get(overview.first), clip, new Space(overview.spaces[0]), overview.skeletons[0]);
  const found = motion.originalPositions();
  const expected = readBvh(join(work, "clips", "run_fast_001.bvh"));
  let most = 0;
  expected.frames.flat(2).forEach((value, i) => (most = Math.max(most, Math.abs(value - found[i]))));
  assert.ok(most <= 0.0051, `${most} cm`);
});

test("what cannot be is refused, and nothing is written", () => {
  assert.equal(refused("view", library, "no_such_clip", "-o", "none.html").code, 2);
  assert.equal(refused("view", "no.kspace", "-o", "none.html").code, 1);
  assert.equal(refused("view", library, "-o", library).code, 2);
  assert.equal(refused("view", library, "-o", "none.html", "--max-size", "0").code, 2);
  assert.equal(refused("view", library, "-o", "none.html", "--nearest", "21").code, 2);
  assert.ok(!haveFile(join(work, "none.html")));
  // Without -o the page has the library's name; what stands there is somebody's.
  const notes = join(work, "sample.html");
  writeFileSync(notes, "Nobody should lose this.\n");
  assert.equal(refused("view", library).code, 2);
  assert.equal(readFileSync(notes, "utf8"), "Nobody should lose this.\n");
});
