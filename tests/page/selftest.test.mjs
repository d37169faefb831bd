// SPDX-License-Identifier: MIT
// The page /selftest, in an emulated headset and in a window: its steps, its report and its verdicts.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drawNothing, kChromium, launchBrowser, openPage, takePicture, untilFrames, untilState } from "./browser.mjs";
import { openHeadset, pinch, reach, vertex } from "./headset.mjs";
import { writeHangingSheet } from "./scenes.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kRows = 40;
const kColumns = 32;
const kStep = 0.02; // m, way of a hand from one drawn frame to the next
const kLongest = 900; // s; tests end longer tests themselves

let folder;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-selftest-"));
  server = await startServer(0, ["--scene-file", await writeHangingSheet(folder), "--scene", "hanging"]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

// The saved file, after the result is shown.
async function savedReport(page) {
  await page.waitForSelector("#results:not([hidden])");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#download")]);
  assert.match(download.suggestedFilename(), /^clothstream-selftest-\d{4}-\d\d-\d\dT\d{6}\.json$/);
  const text = await readFile(await download.path(), "utf8");
  assert.equal(text, await page.inputValue("#json"));
  return JSON.parse(text);
}

async function verdictsOf(page) {
  const rows = await page.locator("#verdicts tr").evaluateAll((list) => list.map((row) => [...row.children].map((cell) => cell.textContent)));
  return Object.fromEntries(rows.map(([name, result, grade, meaning]) => [name, { result, grade, meaning }]));
}

// The names of all members, with their kinds.
function shapeOf(value) {
  if (value === null || Array.isArray(value) || typeof value !== "object") return value === null ? "null" : Array.isArray(value) ? "list" : typeof value;
  return Object.fromEntries(Object.entries(value).map(([name, member]) => [name, shapeOf(member)]));
}

// Members with these names in docs/selftest.md, by dotted path.
async function documentedMembers() {
  const page = await readFile(new URL("../../docs/selftest.md", import.meta.url), "utf8");
  return new Set([...page.matchAll(/^\| `([\w.]+)` \|/gm)].map(([, name]) => name));
}

function pathsOf(shape, prefix = "") {
  return Object.entries(shape).flatMap(([name, kind]) => (typeof kind === "object" && !("median" in kind) && !("left" in kind) ? pathsOf(kind, `${prefix}${name}.`) : [`${prefix}${name}`]));
}

test("a headset is measured: display, threads, hands for part of the time, and a grab", async () => {
  const page = await openHeadset(browser, `${server.url}selftest?seconds=${kLongest}`, { prepare: drawNothing });
  try {
    await untilState(page, "live");
    await untilFrames(page, 10);
    // One hand from the start, the other one only later.
    await page.evaluate(() => (window.device.hands.left.connected = false));
    await page.click("#start-vr");
    await page.waitForFunction(() => window.clothstream.headset.limbs.some(({ isHand }) => isHand));
    await page.waitForFunction(() => document.getElementById("left").textContent.endsWith(" s"));
    assert.match(await page.textContent("#step"), /both hands/);
    const low = (kRows - 1) * kColumns + 16;
    const start = await vertex(page, low);
    await reach(page, "right", start, [0, 0, 0.25]);
    await reach(page, "right", start, [0, 0, 0.02], kStep);
    await pinch(page, 1);
    await page.waitForFunction(() => window.clothstream.headset.limbs.some(({ holds }) => holds));
    await untilFrames(page, 90);
    await pinch(page, 0);
    const alone = await page.evaluate(() => window.clothstream.headset.frames);
    await page.evaluate(() => (window.device.hands.left.connected = true));
    await page.waitForFunction((before) => window.clothstream.headset.frames > 1.3 * before, alone);
    const frames = await page.evaluate(() => window.clothstream.headset.frames);
    // The emulator's picture covers the button.
    await page.evaluate(() => document.getElementById("stop").click());
    const report = await savedReport(page);
    assert.equal(await page.evaluate(() => window.clothstream.headset.mode), undefined);

    assert.equal(report.schema, "clothstream-selftest");
    assert.equal(report.version, 1);
    assert.equal(report.requestedSeconds, kLongest);
    assert.equal(report.complete, false);
    assert.ok(Math.abs(Date.parse(report.date) - Date.now()) < 60_000, report.date);
    assert.equal(report.device.userAgent, await page.evaluate(() => navigator.userAgent));
    assert.match(report.device.graphics, /SwiftShader/);
    assert.deepEqual(report.page, { secure: true, isolated: true });
    assert.equal(report.session.mode, "immersive-vr");
    assert.ok(report.session.features === null || report.session.features.includes("hand-tracking"), `${report.session.features}`);
    // Frames by the emulator's own count; it draws some before and after.
    const { display, stream, threads, hands, controllers, grabs, touch } = report;
    assert.ok(display.frames > 0.5 * frames && display.frames <= frames + 30, `${display.frames} of ${frames} frames`);
    assert.ok(Math.abs(display.rate - display.frames / report.seconds) < 0.1 * display.rate + 1, `${display.rate} Hz, ${display.frames} frames in ${report.seconds} s`);
    assert.ok(display.gapMs.median > 0 && display.gapMs.median <= display.gapMs.p99 && display.gapMs.p99 <= display.gapMs.largest);
    assert.equal(stream.scene, "hanging");
    assert.equal(stream.vertices, kRows * kColumns);
    assert.equal(stream.nominalRate, 72);
    assert.ok(stream.frames > 90 && stream.rate <= 80, `${stream.frames} frames, ${stream.rate} a second`);
    assert.deepEqual([stream.decodeErrors, stream.hashMismatches, stream.reconnects], [0, 0, 0]);
    for (const [name, { median, largest }] of Object.entries(threads)) assert.ok(median > 0 && largest < 5000, `${name}: ${median} ms, ${largest} ms`);
    assert.ok(report.poseToDisplayableMs.median > 0);
    assert.ok(hands.right > 0.95, `the right hand in ${hands.right} of the frames`);
    assert.ok(hands.left > 0.05 && hands.left < 0.6, `the left hand in ${hands.left} of the frames`);
    assert.deepEqual(controllers, { left: 0, right: 0 });
    assert.ok(grabs.presses === 1 && grabs.taken === 1 && grabs.confirmed === 1 && grabs.slipped === 0, JSON.stringify(grabs));
    assert.ok(grabs.longestSeconds > 0.9, `${grabs.longestSeconds} s`);
    assert.ok(touch.share > 0 && touch.largestCorrectionMm > 0, JSON.stringify(touch));

    const verdicts = await verdictsOf(page);
    assert.equal(verdicts.Hands.grade, "poor");
    assert.equal(verdicts.Grabs.grade, "good");
    const documented = await documentedMembers();
    assert.deepEqual(pathsOf(shapeOf(report)).filter((path) => !documented.has(path)), []);
    await page.setViewportSize({ width: 900, height: 1100 });
    await takePicture(page, "selftest_result");
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
  }
});

test("controllers are counted, and a second test starts at zero", async () => {
  const page = await openHeadset(browser, `${server.url}selftest?seconds=${kLongest}`, { input: "controller" });
  try {
    await untilState(page, "live");
    for (let run = 0; run < 2; ++run) {
      await page.click("#start-vr");
      const { frames } = await page.evaluate(() => window.clothstream.headset);
      await page.waitForFunction((before) => window.clothstream.headset.frames > before + 15, frames);
      await untilFrames(page, 10);
      if (run === 0) await takePicture(page, "selftest_vr");
      // The user leaves VR with the button of the headset.
      await page.evaluate(() => window.device.activeSession.end());
      await page.waitForSelector("#results:not([hidden])");
      const report = JSON.parse(await page.inputValue("#json"));
      assert.ok(report.controllers.left > 0.9 && report.controllers.right > 0.9, JSON.stringify(report.controllers));
      assert.deepEqual(report.hands, { left: 0, right: 0 });
      const drawn = await page.evaluate(() => window.clothstream.headset.frames);
      assert.ok(report.display.frames <= drawn - frames + 5, `${report.display.frames} of ${drawn - frames} frames`);
    }
  } finally {
    await page.context().close();
  }
});

test("without a headset the rest is measured for the whole time, and the page says what is missing", async () => {
  const page = await openPage(browser, `${server.url}selftest?seconds=5&scene=flag`);
  try {
    await page.waitForSelector("#no-vr:not([hidden])");
    assert.match(await page.textContent("#no-vr"), /no headset/);
    assert.ok(await page.isHidden("#start-vr"));
    await page.click("#start-window");
    const report = await savedReport(page);
    assert.equal(report.complete, true);
    assert.ok(report.seconds >= 5, `${report.seconds} s`);
    assert.equal(report.stream.scene, "flag");
    assert.equal(report.session.mode, null);
    for (const name of ["hands", "controllers", "grabs", "touch"]) assert.equal(report[name], null, name);
    const verdicts = await verdictsOf(page);
    for (const name of ["Hands", "Grabs"]) assert.equal(verdicts[name].grade, "not measured");
    assert.notEqual(verdicts.Display.grade, "not measured");
    await page.click("#copy");
    await page.waitForFunction(() => /Copied|Selected/.test(document.getElementById("copy").textContent));
    await page.setViewportSize({ width: 390, height: 1200 });
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), "the page is wider than a phone");
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
});

test("a length that is not allowed is named, and the usual one is used", async () => {
  const page = await openPage(browser, `${server.url}selftest?seconds=1`);
  try {
    await page.waitForSelector("#wrong:not([hidden])");
    assert.match(await page.textContent("#wrong"), /seconds=1 is not allowed; use 3 to 900/);
    assert.equal(await page.textContent("#length"), "2 minutes");
  } finally {
    await page.close();
  }
});

test("a scene that does not exist is named", async () => {
  const page = await openPage(browser, `${server.url}selftest?scene=nowhere`);
  try {
    await page.waitForFunction(() => /nowhere/.test(document.getElementById("message").textContent));
  } finally {
    await page.close();
  }
});
