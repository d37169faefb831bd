// SPDX-License-Identifier: MIT
// The page with a recording: its timeline shows and controls the playback.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePicture, untilFrames, untilState } from "./browser.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

let server;
let browser;
let page;
before(async () => {
  server = await startServer(0, ["play", process.env.CLOTHSTREAM_RECORDING, "--loop"]);
  browser = await launchBrowser();
  page = await openPage(browser, server.url, { viewport: { width: 800, height: 450 } });
  await untilState(page, "live");
  await untilFrames(page, 5);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const playback = () => page.evaluate(() => window.clothstream.playback);
const until = (wanted, value) => page.waitForFunction(wanted, value);

test("a recording has a timeline and no controls of the simulation", async () => {
  const { length, paused, loop, speed } = await playback();
  assert.ok(length > 1);
  assert.deepEqual([paused, loop, speed], [false, true, 1]);
  await page.locator("#player").waitFor({ state: "visible" });
  for (const tab of ["cloth", "air"]) assert.equal(await page.locator(`#tab-${tab}`).isVisible(), false);
  await page.click("#tab-view");
  assert.equal(await page.locator("#reset").isVisible(), true);
  const before = (await playback()).position;
  await until((then) => window.clothstream.playback.position !== then, before);
  assert.match(await page.locator("#player-time").textContent(), /^\d+:\d\d\.\d \/ \d+:\d\d\.\d$/);
  await takePicture(page, "recording");
});

test("the button pauses and continues", async () => {
  await page.getByRole("button", { name: "Pause" }).click();
  await until(() => window.clothstream.playback.paused);
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
  const { frames } = await page.evaluate(() => window.clothstream.statistics);
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await until((then) => window.clothstream.statistics.frames > then + 3, frames);
});

test("the timeline seeks and shows the frame", async () => {
  await page.getByRole("button", { name: "Pause" }).click();
  await until(() => window.clothstream.playback.paused);
  const { length } = await playback();
  const before = await page.evaluate(() => window.clothstream.statistics);
  await page.locator("#player-position").fill(String(length / 2));
  // Playback starts at the previous key frame, at most 24 frames earlier.
  await until((half) => Math.abs(window.clothstream.playback.position - half) < 0.6, length / 2);
  await until((then) => window.clothstream.statistics.keyFrames > then, before.keyFrames);
  const after = await page.evaluate(() => window.clothstream.statistics);
  assert.equal(after.decodeErrors, 0);
  assert.equal(after.hashMismatches, 0);
  assert.ok(after.tick > before.tick);
});

test("speed and loop act for all pages", async () => {
  const other = await openPage(browser, server.url);
  await untilState(other, "live");
  await page.locator("#player-speed").selectOption("0.5");
  await page.locator("#player-loop").uncheck();
  await other.waitForFunction(() => window.clothstream.playback?.speed === 0.5 && !window.clothstream.playback.loop);
  await other.locator("#player-speed").evaluate((select) => select.value).then((value) => assert.equal(value, "0.5"));
  assert.deepEqual(other.errors, []);
  await other.close();
});

test("the page reported no errors", () => assert.deepEqual(page.errors, []));
