// SPDX-License-Identifier: MIT
// Mouse, fingers, keyboard and size of the window on a real server.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, kPicture, launchBrowser, openPage, takePicture, untilFrames, untilState } from "./browser.mjs";
import { distance, look, untilAtRest, vertexOf } from "./frames.mjs";
import { writeHangingSheet } from "./scenes.mjs";
import { startServer } from "./server.mjs";
import { fingersOn } from "./touch.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

let folder;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-input-"));
  server = await startServer(0, ["--scene", "curtain", "--scene-file", await writeHangingSheet(folder)]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

async function withPage(options, use) {
  const page = await openPage(browser, server.url + (options.query ?? ""), options);
  try {
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

// The lower edge of the sheet is blown away from the camera, and falls back when the pointer leaves.
test("a fan blows at the cloth", () =>
  withPage({ query: "?scene=hanging", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 60);
    const edge = 39 * 32 + 16;
    const rest = vertexOf((await look(page)).positions, edge);
    const [x, y] = await page.evaluate((at) => window.clothstream.project(at), rest);
    await page.check('input[name="tool"][value="fan"]');
    await page.mouse.move(x, y - 40);
    await page.mouse.down();
    await page.waitForFunction(
      ([vertex, from]) => {
        const at = window.clothstream.positions.slice(3 * vertex, 3 * vertex + 3);
        return Math.hypot(at[0] - from[0], at[1] - from[1], at[2] - from[2]) > 0.02;
      },
      [edge, rest],
    );
    await page.mouse.up();
    await page.check('input[name="tool"][value="hand"]');
    await page.waitForFunction(
      ([vertex, from]) => {
        const at = window.clothstream.positions.slice(3 * vertex, 3 * vertex + 3);
        return Math.hypot(at[0] - from[0], at[1] - from[1], at[2] - from[2]) < 0.02;
      },
      [edge, rest],
    );
  }));

// The middle of the lower edge follows the mouse, and falls back when the mouse releases it.
test("the cloth can be grabbed", () =>
  withPage({ query: "?scene=hanging", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 60);
    const corner = 39 * 32 + 16;
    const seen = await look(page);
    const start = vertexOf(seen.positions, corner);
    const goal = [start[0], start[1] + 0.4, start[2]];
    const project = (point) => page.evaluate((at) => window.clothstream.project(at), point);
    const [x, y] = await project(start);
    const [goalX, goalY] = await project(goal);
    // Slightly above the edge, so that the pointer is on the cloth.
    await page.mouse.move(x, y - 6);
    await page.mouse.down();
    assert.equal(await page.evaluate(() => window.clothstream.canvas.style.cursor), "grabbing");
    await page.mouse.move(goalX, goalY - 6, { steps: 20 });
    await page.waitForFunction(
      ([vertex, height]) => window.clothstream.positions[3 * vertex + 1] > height,
      [corner, goal[1] - 0.05],
    );
    await untilFrames(page, 72);
    const held = (await look(page)).positions[3 * corner + 1];
    assert.ok(Math.abs(held - goal[1]) < 0.1, `the held vertex is at y = ${held}, not near ${goal[1]}`);
    await takePicture(page, "held");
    await page.mouse.up();
    await page.waitForFunction(
      ([vertex, height]) => window.clothstream.positions[3 * vertex + 1] < height,
      [corner, start[1] + 0.1],
    );
  }));

// The keys of docs/page.md, with the focus on the picture.
test("the keyboard turns, zooms and resets the view, and moves the collider", () =>
  withPage({ viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await page.focus("#canvas");
    const corners = [[-0.8, 1.8, 0], [0.8, 1.8, 0]];
    const shown = () => page.evaluate((points) => points.map((point) => window.clothstream.project(point)), corners);
    const width = ([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    const press = async (...keys) => {
      for (const key of keys) await page.keyboard.press(key);
      await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      return shown();
    };
    const start = await press();
    const zoomed = await press("+", "+", "+");
    assert.ok(width(zoomed) > 1.15 * width(start), `${width(start)} pixels became ${width(zoomed)}`);
    assert.ok(width(await press("-", "-", "-", "-")) < 1.05 * width(start));
    assert.notDeepEqual(await press("r", "ArrowUp"), start);
    assert.notDeepEqual(await press("r", "ArrowLeft"), start);
    (await press("r")).flat().forEach((value, i) => assert.ok(Math.abs(value - start.flat()[i]) < 1, `${value} instead of ${start.flat()[i]}`));

    // A key ends the collider's own motion; each press moves it by 3 cm.
    await page.keyboard.press("w");
    await untilAtRest(page);
    const from = (await look(page)).spheres[0].position;
    for (let i = 0; i < 5; ++i) {
      await page.keyboard.press("w");
      await page.keyboard.press("d");
    }
    await page.waitForFunction(([, y]) => window.clothstream.colliders[0].position[1] > y + 0.1, from);
    await untilAtRest(page);
    const to = (await look(page)).spheres[0].position;
    assert.ok(distance(from, to) > 0.15, `it went from ${from} to ${to}`);
  }));

// The sheet hangs in the middle; the background below it.
test("one finger takes hold of cloth or turns the view, and two always zoom", () =>
  withPage({ query: "?scene=hanging", viewport: { width: 390, height: 700 }, touch: true }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 30);
    const seen = await look(page);
    const corner = 39 * 32 + 16;
    const low = vertexOf(seen.positions, corner);
    const project = (...points) => page.evaluate((all) => all.map((point) => window.clothstream.project(point)), points);
    const ends = [[-0.3, 1.2, 0], [0.3, 1.2, 0]];
    const apart = async () => {
      const [a, b] = await project(...ends);
      return distance([...a, 0], [...b, 0]);
    };
    const fingers = await fingersOn(page);
    const [[x, y], [goalX, goalY]] = await project(low, [low[0], low[1] + 0.35, low[2]]);
    const before = await apart();
    await fingers.down([x, y - 8]);
    await fingers.move(10, [goalX, goalY - 8]);
    await page.waitForFunction(([vertex, height]) => window.clothstream.positions[3 * vertex + 1] > height, [corner, low[1] + 0.25]);
    await takePicture(page, "phone_grab");
    assert.ok(Math.abs((await apart()) - before) < 1, "the view stays while the cloth is held");

    // The second finger: the cloth falls back, and the fingers move apart to zoom.
    await fingers.down([goalX, goalY - 8], [goalX + 60, goalY - 8]);
    await fingers.move(5, [goalX - 40, goalY - 8], [goalX + 120, goalY - 8]);
    await page.waitForFunction(([vertex, height]) => window.clothstream.positions[3 * vertex + 1] < height, [corner, low[1] + 0.1]);
    const near = await apart();
    assert.ok(near > 1.5 * before, `${before} pixels became ${near}`);
    // Both to the same side: the view pans.
    const [there] = await project(ends[0]);
    await fingers.move(5, [goalX, goalY + 32], [goalX + 160, goalY + 32]);
    await page.evaluate(() => new Promise((done) => setTimeout(done, 500)));
    const [panned] = await project(ends[0]);
    assert.ok(panned[0] > there[0] + 15 && panned[1] > there[1] + 15, `${there} became ${panned}`);
    await fingers.up(1);
    await fingers.up();

    await page.evaluate(() => document.activeElement.blur());
    await page.click("#tab-view");
    await page.click("#reset");
    await page.click("#tab-view");
    const front = await apart();
    await fingers.down([340, 540]);
    await fingers.move(5, [240, 540]);
    await fingers.up();
    await page.waitForFunction(([all, was]) => {
      const [a, b] = all.map((point) => window.clothstream.project(point));
      return Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.9 * was;
    }, [ends, front]);
    const rested = await look(page);
    assert.ok(rested.positions[3 * corner + 1] < low[1] + 0.1, "the background holds no cloth");
  }));

test("the view follows the size of the window, until the user has moved it", () =>
  withPage({ viewport: kPicture, query: "?scene=hanging" }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 5);
    const resize = async (width, height) => {
      await page.setViewportSize({ width, height });
      await page.waitForFunction(() => {
        const { canvas } = window.clothstream;
        return canvas.width === Math.floor(canvas.clientWidth * Math.min(devicePixelRatio, 2)) && canvas.clientHeight <= window.innerHeight;
      });
      await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    };
    const outside = () =>
      page.evaluate(() => {
        const { positions, canvas, project } = window.clothstream;
        const frame = canvas.getBoundingClientRect();
        let count = 0;
        for (let i = 0; i < positions.length; i += 3) {
          const [x, y] = project(Array.from(positions.slice(i, i + 3)));
          if (!(x >= frame.left && x <= frame.right && y >= frame.top && y <= frame.bottom)) ++count;
        }
        return count;
      });
    for (const [width, height] of [[360, 640], [900, 300], [700, 800]]) {
      await resize(width, height);
      assert.equal(await outside(), 0, `${width} x ${height}`);
    }
    // Height that a metre has in the picture, which depends on the window's height only.
    const metre = async () => {
      const [a, b] = await page.evaluate(() => [[0, 1, 0], [0, 2, 0]].map((point) => window.clothstream.project(point)));
      return a[1] - b[1];
    };
    await page.focus("#canvas");
    for (let i = 0; i < 5; ++i) await page.keyboard.press("+");
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    const near = await metre();
    await resize(800, 800);
    assert.ok(Math.abs((await metre()) - near) < 2, `a metre was ${near} pixels high, and is ${await metre()}`);
  }));
