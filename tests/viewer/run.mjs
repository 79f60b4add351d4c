// run.mjs BUILD ROOT: the tests of the page of `kinespace view`: its types, its reader of motion, its data, and the page in
// a browser. What a machine lacks is skipped and said (scripts/test lists it; in CI it is a failure).
import { spawnSync } from "node:child_process";
import { cpSync, mkdirSync, readdirSync } from "node:fs";
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

function prepare() {
  const quiet = { cwd: folder, stdio: ["ignore", "ignore", "inherit"] };
  if (run(join(build, "kinespace-samples"), ["clips"], quiet)) throw new Error("no sample clips");
  mkdirSync(join(folder, "few"));
  for (const file of readdirSync(join(folder, "clips"))) {
    if (/^(walk_fast|jump_forward|wave_left|turn_left).*_00[12]\.bvh$/.test(file)) cpSync(join(folder, "clips", file), join(folder, "few", file));
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
