// The page in a browser, opened from the disk: each panel by what it shows and does.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { build, dataOf, kinespace, library, work } from "./support.mjs";

const chromiumPath = process.env.KINESPACE_CHROMIUM ?? "/usr/bin/chromium";
const skip = existsSync(chromiumPath) ? false : `no browser: ${chromiumPath} is not there (apt-get install chromium)`;
const { chromium } = createRequire(join(build, "viewer", "package.json"))("playwright-core");

// Names that would do harm if they were taken for HTML, for the end of the data or for what a terminal obeys.
const evil = "</script><img src=x onerror=alert(1)>&amp;\u001b[31m\u202eevil";
const evilLabel = "\"><svg onload=alert(2)>";

let context;
let info;
const page_ = join(work, "page.html");
const complaints = [];
const requests = [];

before(async () => {
  if (skip) return;
  kinespace("view", library, "-o", page_, "--quiet");
  info = JSON.parse(kinespace("info", library, "--json"));
  context = await chromium.launchPersistentContext(mkdtempSync(join(work, "profile-")), {
    executablePath: chromiumPath,
    headless: true,
    viewport: { width: 980, height: 560 }, // the browser draws without a GPU
    reducedMotion: "reduce", // the page does not play by itself then
    args: ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
});

after(async () => {
  await context?.close();
});

async function open(file = page_, size) {
  const page = await context.newPage();
  // One that a failed test left would go on drawing.
  for (const other of context.pages()) if (other !== page) await other.close();
  complaints.length = requests.length = 0;
  if (size) await page.setViewportSize(size);
  page.setDefaultTimeout(120_000); // no claim: a machine may be busy
  page.on("console", (message) => complaints.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("dialog", async (dialog) => {
    complaints.push(`dialog: ${dialog.message()}`);
    await dialog.dismiss();
  });
  page.on("request", (request) => requests.push(request.url()));
  await page.goto(pathToFileURL(file).href);
  return page;
}

// Every test ends with it: nothing was complained of, and the page asked for nothing but itself.
async function close(page, file = page_) {
  await page.close();
  assert.deepEqual(complaints.splice(0), []);
  const others = requests.splice(0).filter((url) => url !== pathToFileURL(file).href && !url.startsWith("data:"));
  assert.deepEqual(others, []);
}

async function choose(page, name) {
  await page.fill("#search", name);
  await page.press("#search", "Enter");
  assert.equal(await page.evaluate(() => document.activeElement.id), "canvas");
  await page.fill("#search", "");
  await page.locator("#canvas").focus();
  assert.equal(await page.textContent("#clip-name"), name);
}

const set = (page, id, value) =>
  page.evaluate(([of, to]) => {
    const input = document.getElementById(of);
    input.value = to;
    input.dispatchEvent(new Event("input"));
  }, [id, String(value)]);
const frame = async (page) => Number((await page.textContent("#time")).split("·")[1]);
// After the next picture.
const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const picture = async (page, of = "#canvas") => (await page.locator(of).screenshot()).toString("base64");

test("the player plays, pauses, scrubs, steps and loops", { skip }, async () => {
  const page = await open();
  assert.equal(await page.textContent("#library"), "sample.kspace");
  assert.match(await page.textContent("#totals"), new RegExp(`^${info.clips} clips, `));
  await choose(page, "walk_fast_001");
  const { frames } = info.clip_list.find((clip) => clip.name === "walk_fast_001");
  assert.match(await page.textContent("#clip-facts"), new RegExp(`${frames} frames at 60 Hz · walk, fast`));
  await set(page, "scrub", 20);
  await drawn(page);
  assert.equal(await frame(page), 20);
  const still = await picture(page);
  assert.equal(await picture(page), still, "a paused player stands still");
  await page.click("#forth");
  await drawn(page);
  assert.equal(await frame(page), 21);
  assert.notEqual(await picture(page), still, "a frame on is another picture");
  await page.click("#back");
  await drawn(page);
  assert.equal(await frame(page), 20);
  await set(page, "scrub", frames - 8);
  assert.equal(await page.getAttribute("#play", "aria-label"), "Play");
  await page.click("#play");
  assert.equal(await page.getAttribute("#play", "aria-label"), "Pause");
  await page.waitForFunction(() => Number(document.getElementById("time").textContent.split("·")[1]) < 60); // round again
  await page.click("#play");
  await page.click("#loop");
  await set(page, "scrub", frames - 4);
  await page.click("#play");
  await page.waitForFunction(() => document.getElementById("play").getAttribute("aria-label") === "Play");
  await drawn(page);
  assert.equal(await frame(page), frames - 1, "without a loop it ends at the last frame");
  await close(page);
});

test("the view turns, goes nearer, follows; trails and the ghost are seen", { skip }, async () => {
  const page = await open();
  await choose(page, "run_fast_001");
  await set(page, "lod", 1);
  await set(page, "scrub", 30);
  await drawn(page);
  let seen = await picture(page);
  const changes = async (what) => {
    await drawn(page);
    const now = await picture(page);
    assert.notEqual(now, seen, what);
    seen = now;
  };
  const box = await page.locator("#canvas").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 90, box.y + box.height / 2 + 20, { steps: 3 });
  await page.mouse.up();
  await changes("a drag turns the view");
  await page.mouse.wheel(0, -300);
  await changes("the wheel goes nearer");
  for (const name of ["follow", "trails", "ghost"]) {
    const before = await page.getAttribute(`#${name}`, "aria-pressed");
    await page.click(`#${name}`);
    assert.notEqual(await page.getAttribute(`#${name}`, "aria-pressed"), before);
    await changes(name);
  }
  assert.match(await page.textContent("#ghost-says"), /all functions, which stand for the original/);
  await close(page);
});

test("with --originals the ghost is the clip as it was read, and says so", { skip }, async () => {
  const file = join(work, "ghost.html");
  kinespace("view", library, "jump_forward_001", "-o", file, "--nearest", "0", "--originals", "--quiet");
  const page = await open(file);
  assert.equal(await page.textContent("#clip-name"), "jump_forward_001");
  assert.match(await page.textContent("#left-out"), /^1 of them play here/);
  await page.keyboard.press("g");
  assert.match(await page.textContent("#ghost-says"), /as it was read from its file/);
  assert.ok(await page.isDisabled("#compare"));
  await close(page, file);
});

test("the map: search, legend, preview, and a click plays", { skip }, async () => {
  const page = await open();
  await page.fill("#search", "jump");
  assert.match(await page.textContent("#found-note"), /^2 of 12 clips/);
  assert.deepEqual(await page.locator("#found li span:first-child").allTextContents(), ["jump_forward_001", "jump_forward_002"]);
  await page.click("#found button >> nth=1");
  assert.equal(await page.textContent("#clip-name"), "jump_forward_002");
  await page.press("#search", "Escape");
  assert.ok(await page.isHidden("#found"));
  const chips = await page.locator("#legend .chip").allTextContents();
  assert.deepEqual(chips, ["walk 4", "jump 2", "run 2", "turn 2", "wave 2"]);
  const all = await picture(page, "#map-canvas");
  await page.click("#legend .chip >> nth=0");
  assert.match(await page.textContent("#found-note"), /^4 of 12 clips/);
  assert.notEqual(await picture(page, "#map-canvas"), all, "the others fade");
  await page.click("#legend .chip >> nth=0");
  const box = await page.locator("#map-canvas").boundingBox();
  const previewed = async () => {
    for (let y = 6; y < box.height; y += 14) {
      for (let x = 6; x < box.width; x += 14) {
        await page.mouse.move(box.x + x, box.y + y);
        if (await page.isVisible("#preview")) {
          const name = await page.textContent("#preview-name");
          if (name !== "jump_forward_002") return name;
        }
      }
    }
    throw new Error("no dot has a preview");
  };
  const name = await previewed();
  assert.ok(info.clip_list.some((clip) => clip.name === name), name);
  const first = await picture(page, "#preview-canvas");
  await page.waitForTimeout(250);
  assert.notEqual(await picture(page, "#preview-canvas"), first, "the preview moves");
  await page.mouse.down();
  await page.mouse.up();
  assert.equal(await page.textContent("#clip-name"), name);
  await close(page);
});

test("the level of detail plays live, with the errors that were measured", { skip }, async () => {
  const page = await open();
  await choose(page, "walk_normal_001");
  await set(page, "scrub", 40);
  const levels = info.spaces[0].levels;
  assert.equal(await page.getAttribute("#lod", "max"), String(levels));
  assert.equal(await page.textContent("#lod-value"), `all ${levels} functions`);
  await drawn(page);
  const all = await picture(page);
  await set(page, "lod", 1);
  await drawn(page);
  assert.notEqual(await picture(page), all, "one function is another pose");
  assert.equal(await page.textContent("#lod-value"), `1 of ${levels} functions`);
  const [one] = info.levels;
  const shown = async (id) => {
    const [value, unit] = (await page.textContent(id)).split(" ");
    return Number(value) / (unit === "mm" ? 10 : 1);
  };
  assert.ok(Math.abs((await shown("#lod-library-mean")) / one.mean_joint_error_cm - 1) < 0.05);
  assert.ok(Math.abs((await shown("#lod-library-max")) / one.max_joint_error_cm - 1) < 0.05);
  const own = JSON.parse(kinespace("export", library, "walk_normal_001", "--lod", "1", "--no-plant-feet", "-o", "one.bvh", "--json"));
  assert.ok(Math.abs((await shown("#lod-mean")) / own.mean_joint_error_cm - 1) < 0.05);
  assert.ok(Math.abs((await shown("#lod-max")) / own.max_joint_error_cm - 1) < 0.05);
  const numbers = Number((await page.textContent("#lod-numbers")).replace(",", ""));
  await page.keyboard.press("+");
  assert.equal(await page.textContent("#lod-value"), `2 of ${levels} functions`);
  assert.ok(Number((await page.textContent("#lod-numbers")).replace(",", "")) > numbers);
  assert.ok((await page.locator("#error-chart path").count()) >= 2);
  assert.ok((await page.locator("#function-chart path").count()) >= 2);
  const kind = await page.inputValue("#kind");
  const functions = info.spaces[0].sets.find((s) => String(s.cycles) === kind).functions_of_a_curve;
  assert.equal(await page.locator("#variance-chart rect").count(), functions);
  await close(page);
});

test("the nearest motions are those of query, and stand side by side", { skip }, async () => {
  const page = await open();
  await choose(page, "walk_fast_002");
  const { matches } = JSON.parse(kinespace("query", library, "walk_fast_002", "-k", "5", "--json"));
  assert.deepEqual(await page.locator("#nearest .name").allTextContents(), matches.map((match) => match.clip));
  assert.deepEqual(await page.locator("#nearest .distance").allTextContents(), matches.map((match) => match.distance.toFixed(4)));
  await page.click("#compare");
  assert.deepEqual(await page.locator(".caption strong").allTextContents(), ["walk_fast_002", ...matches.map((match) => match.clip)]);
  await set(page, "scrub", 10);
  await drawn(page);
  const before = await picture(page);
  await set(page, "scrub", 40);
  await drawn(page);
  assert.notEqual(await picture(page), before);
  await page.click("#nearest button >> nth=0");
  assert.equal(await page.textContent("#clip-name"), matches[0].clip);
  await close(page);
});

test("contact bars go with the playhead", { skip }, async () => {
  const page = await open();
  await choose(page, "walk_fast_001");
  const { overview, motions } = dataOf(page_);
  const { feet } = motions.get(overview.clips.findIndex((clip) => clip.name === "walk_fast_001"));
  assert.equal(await page.locator("#contacts .row").count(), feet.joints.filter((joint) => joint >= 0).length);
  assert.equal(await page.locator("#contacts .bar").count(), feet.contacts.length);
  assert.ok(feet.contacts.length > 2);
  for (const at of [5, 33, 80]) {
    await set(page, "scrub", at);
    await drawn(page);
    const standing = feet.contacts.filter(([, first, last]) => at >= first && at <= last).length;
    assert.equal(await page.locator("#contacts .bar.now").count(), standing, `frame ${at}`);
  }
  await close(page);
});

test("all of it by keys, and everything has a name", { skip }, async () => {
  const page = await open();
  await choose(page, "walk_fast_001");
  await page.locator("#canvas").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Shift+ArrowRight");
  await drawn(page);
  assert.equal(await frame(page), 11);
  await page.keyboard.press("End");
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Home");
  await drawn(page);
  assert.equal(await frame(page), 0);
  await page.keyboard.press(".");
  assert.equal(await page.inputValue("#speed"), "1.5");
  await page.keyboard.press("n");
  assert.notEqual(await page.textContent("#clip-name"), "walk_fast_001");
  await page.keyboard.press("p");
  assert.equal(await page.textContent("#clip-name"), "walk_fast_001");
  await page.keyboard.press("Space");
  assert.equal(await page.getAttribute("#play", "aria-label"), "Pause");
  await page.keyboard.press("Space");
  await page.keyboard.press("?");
  assert.ok(await page.isVisible("#help"));
  await page.keyboard.press("Escape");
  assert.ok(await page.isHidden("#help"));
  await page.keyboard.press("/");
  assert.equal(await page.evaluate(() => document.activeElement.id), "search");
  const nameless = await page.evaluate(() =>
    [...document.querySelectorAll("button, input, select, canvas:not([aria-hidden])")]
      .filter((e) => !(e.getAttribute("aria-label") || e.textContent.trim() || e.labels?.length))
      .map((e) => e.outerHTML),
  );
  assert.deepEqual(nameless, []);
  await close(page);
});

test("a phone's width needs no scrolling sideways, light or dark", { skip }, async () => {
  const page = await open(page_, { width: 390, height: 844 });
  const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await ground();
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
    for (const compare of [false, true]) {
      if (compare) await page.click("#compare");
      const wide = await page.evaluate(() => ({
        page: document.documentElement.scrollWidth,
        beyond: [...document.querySelectorAll("main *, header *")]
          .filter((e) => e.getBoundingClientRect().right > innerWidth + 1 && getComputedStyle(e).position !== "absolute" && !e.closest(".hidden"))
          .map((e) => e.id || e.className || e.tagName),
      }));
      assert.equal(wide.page, 390);
      assert.deepEqual(wide.beyond, []);
      if (compare) await page.click("#compare");
    }
  }
  assert.notEqual(await ground(), light);
  await close(page);
});

test("names are text, whatever is in them", { skip }, async () => {
  const hostile = join(work, "hostile.kspace");
  copyFileSync(library, hostile);
  const change = `
import sqlite3, sys
library = sqlite3.connect(sys.argv[1])
library.execute("UPDATE clips SET name = ? WHERE name = 'walk_fast_001'", (sys.argv[2],))
library.execute("UPDATE clip_labels SET label = ? WHERE label = 'jump'", (sys.argv[3],))
library.commit()`;
  execFileSync("python3", ["-c", change, hostile, evil, evilLabel]);
  const file = join(work, "hostile.html");
  kinespace("view", hostile, "-o", file, "--nearest", "2", "--quiet");
  const { text, overview } = dataOf(file);
  assert.ok(overview.clips.some((clip) => clip.name === evil), "the data has the true name");
  assert.ok(!text.includes("<img") && !text.includes("\u001b") && !text.includes("\u202e"));
  const page = await open(file);
  await page.fill("#search", "evil");
  await page.click("#found button");
  assert.equal(await page.textContent("#clip-name"), evil.replace(/[\u001b\u202e]/g, "\ufffd"));
  assert.ok((await page.locator("#legend").textContent()).includes(evilLabel));
  await page.click("#compare");
  assert.equal(await page.locator("img, main svg[onload]").count(), 0);
  await close(page, file);
});

test("a page without a library says so", { skip }, async () => {
  const file = join(build, "viewer", "page.html");
  const page = await open(file);
  assert.match(await page.textContent("#trouble"), /holds no library/);
  await close(page, file);
});
