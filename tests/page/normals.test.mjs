// SPDX-License-Identifier: MIT
// Normals that the vertex shader computes look like those that the client core computes: on grids and on meshes with seams.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import { drawNothing, kChromium, launchBrowser, openPage, takePixels, untilFrames, untilState } from "./browser.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kView = { width: 656, height: 260 };

let server;
let browser;
before(async () => {
  server = await startServer(0, []);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

// Pictures, positions and pixels of vertices of a paused scene, for one way to compute normals.
async function look(scene, normals) {
  const page = await openPage(browser, `${server.url}?scene=${scene}&normals=${normals}`, { viewport: kView });
  const warnings = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && warnings.push(message.text()));
  try {
    await untilState(page, "live");
    await page.waitForFunction(() => window.clothstream.statistics.frames > 0 && window.clothstream.drawnFrames > 0);
    await page.waitForFunction(() => window.clothstream.isComplete);
    const drawn = await page.evaluate(() => window.clothstream.drawnFrames);
    await page.waitForFunction((before) => window.clothstream.drawnFrames > before + 5, drawn);
    const seen = await page.evaluate(() => {
      const { positions, canvas, project } = window.clothstream;
      const places = Array.from({ length: positions.length / 3 }, (_, i) => project(Array.from(positions.slice(3 * i, 3 * i + 3))));
      return { positions: Array.from(positions), places: places.filter(([x, y]) => document.elementFromPoint(x, y) === canvas) };
    });
    const picture = await takePixels(page, `normals_${scene}_${normals}`);
    assert.deepEqual(page.errors, []);
    assert.deepEqual(warnings.filter((text) => /WebGL|shader|texture/i.test(text) && !/ReadPixels|fallback/i.test(text)), []);
    return { ...seen, colours: seen.places.map(([x, y]) => picture.colourAt(x, y)) };
  } finally {
    await page.close();
  }
}

for (const scene of ["curtain", "tablecloth"])
  test(`the scene ${scene} looks the same with normals of the graphics device`, async () => {
    const page = await openPage(browser, `${server.url}?scene=${scene}`, { viewport: kView, prepare: drawNothing });
    try {
      await untilState(page, "live");
      await untilFrames(page, 40);
      await page.click("#scene-pause");
      await page.waitForFunction(() => document.getElementById("scene-pause").textContent === "Continue");
      const cpu = await look(scene, "cpu");
      const gpu = await look(scene, "gpu");
      assert.deepEqual(gpu.positions, cpu.positions);
      assert.ok(cpu.places.length > 500, `${cpu.places.length} vertices are in the picture`);
      const differences = gpu.colours.map((colour, i) => Math.max(...colour.map((value, channel) => Math.abs(value - cpu.colours[i][channel]))));
      const mean = differences.reduce((sum, value) => sum + value, 0) / differences.length;
      const large = differences.filter((value) => value > 6).length / differences.length;
      assert.ok(mean < 0.5 && large < 0.005, `the colours differ by ${mean} of 255 in the mean, and ${100 * large} % by more than 6`);
      // The folds are seen at all: shades differ by far more than that.
      const shades = cpu.colours.map(([red]) => red).sort((a, b) => a - b);
      assert.ok(shades[Math.floor(0.9 * shades.length)] - shades[Math.floor(0.1 * shades.length)] > 20, "the cloth is flat");
    } finally {
      await page.close();
    }
  });
