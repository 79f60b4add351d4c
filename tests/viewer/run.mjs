// run.mjs BUILD ROOT: the tests of the page of `kinespace view`: its types, its reader of motion, its data, and the page in
// a browser. What a machine lacks is skipped and said (scripts/test lists it; in CI it is a failure).
import { spawnSync } from "node:child_process";
import { copyFileSync, mkdirSync, readdirSync, renameSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [build, root] = process.argv.slice(2).map((path) => resolve(path));
process.env.KINESPACE_BUILD = build;
process.env.KINESPACE_ROOT = root;
process.env.KINESPACE_WORK = "/nowhere";
const { makeWork } = await import("./support.mjs");
const here = dirname(fileURLToPath(import.meta.url));
const { folder, remove } = makeWork();
process.env.KINESPACE_WORK = folder;

function run(command, args, options = {}) {
  const done = spawnSync(command, args, { stdio: "inherit", ...options });
  return done.status ?? 1;
}

// A few of the sample clips, and their library.
function prepare() {
  const quiet = { cwd: folder, stdio: ["ignore", "ignore", "inherit"] };
  if (run(join(build, "kinespace-samples"), ["all"], quiet)) throw new Error("no sample clips");
  mkdirSync(join(folder, "clips"));
  for (const file of readdirSync(join(folder, "all"))) {
    if (/^(walk_fast|walk_normal|run_fast|jump_forward|wave_left|turn_left)_00[12]\.bvh$/.test(file)) {
      renameSync(join(folder, "all", file), join(folder, "clips", file));
    }
  }
  mkdirSync(join(folder, "few"));
  for (const name of ["walk_fast_001", "walk_fast_002", "jump_forward_001", "wave_left_001"]) {
    copyFileSync(join(folder, "clips", `${name}.bvh`), join(folder, "few", `${name}.bvh`));
  }
  if (run(join(build, "kinespace"), ["build", "clips", "-o", "sample.kspace", "--quiet"], quiet)) throw new Error("no library");
}

let failed = 0;
try {
  failed = run(process.execPath, [join(build, "viewer/node_modules/typescript/bin/tsc"), "--noEmit", "-p", join(root, "viewer")]);
  if (failed) console.error("viewer/src has errors of types");
  prepare();
  const files = readdirSync(here).filter((file) => file.endsWith(".test.mjs")).map((file) => join(here, file));
  const done = spawnSync(process.execPath, ["--test", "--test-reporter=spec", ...files], { encoding: "utf8", maxBuffer: 1 << 26 });
  process.stdout.write(done.stdout);
  process.stderr.write(done.stderr);
  if (done.status !== 0) failed = 1;
  // As ctest's log has what other tests skip.
  for (const [, name, why] of done.stdout.matchAll(/^\s*\ufe63 (.*?) \([\d.]+ms\) # (.+)$/gm)) {
    console.log(`[  SKIPPED ] viewer.${name.replaceAll(/\s+/g, "_")} (${why})`);
  }
} finally {
  remove();
}
process.exit(failed);
