// SPDX-License-Identifier: MIT
// How the page looks: materials, room, figures of other participants, and a first view that shows all cloths.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { readdir, readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { kChromium, kPicture, launchBrowser, luminance, openPage, takePicture, takePixels, untilFrames, untilState } from "./browser.mjs";
import { joinAsGuest } from "./guest.mjs";
import { startServer } from "./server.mjs";
import { fabricNames } from "../../clients/web/three/dist/fabrics.js";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kScenes = new URL("../../server/scenes/", import.meta.url);
// Simulated seconds after which all cloths are still in view.
const kSeconds = 3;
const kSmall = { width: 400, height: 250 };

const scenes = await Promise.all(
  (await readdir(kScenes)).filter((file) => file.endsWith(".json")).map(async (file) => JSON.parse(await readFile(new URL(file, kScenes), "utf8"))),
);

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

async function withPage(options, use) {
  const page = await openPage(browser, server.url + (options.query ?? ""), options);
  try {
    if (options.scheme) await page.emulateMedia({ colorScheme: options.scheme });
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.close();
  }
}

// Mean colour of the cloth at its vertices, of those that are not behind a card.
async function clothColour(page, picture) {
  const places = await page.evaluate(() => {
    const { positions, canvas, project } = window.clothstream;
    return Array.from({ length: positions.length / 3 }, (_, i) => project(Array.from(positions.slice(3 * i, 3 * i + 3)))).filter(
      ([x, y]) => document.elementFromPoint(x, y) === canvas,
    );
  });
  assert.ok(places.length > 100, `${places.length} vertices are in the picture`);
  const sum = [0, 0, 0];
  for (const [x, y] of places) picture.colourAt(x, y).forEach((value, i) => (sum[i] += value / places.length));
  return sum;
}

test("the default scene is silk, and every material of the server has a look", () =>
  withPage({ viewport: kSmall }, async (page) => {
    await untilState(page, "live");
    assert.equal(await page.textContent("#scene-name"), "veil");
    const offered = await page.locator("#material option").evaluateAll((options) => options.map(({ value }) => value).filter(Boolean));
    assert.deepEqual(offered.sort(), fabricNames().sort());
    assert.equal(await page.inputValue("#material"), "silk");
  }));

// Silk is dyed red, denim is blue, and paper is white.
test("the cloth takes the look of its material, for everyone", () =>
  withPage({ viewport: kPicture }, (first) =>
    withPage({ viewport: kPicture }, async (second) => {
      await untilState(first, "live");
      await untilState(second, "live");
      await untilFrames(second, 60);
      const [red, , blue] = await clothColour(second, await takePixels(second, "silk"));
      assert.ok(red > blue + 40, `silk has red ${red} and blue ${blue}`);
      for (const [material, fits] of [
        ["denim", ([red, , blue]) => blue > red],
        ["paper", (colour) => Math.min(...colour) > 0.75 * Math.max(...colour)],
        ["silk", ([red, , blue]) => red > blue + 40],
      ]) {
        await first.click("#tab-cloth");
        await first.selectOption("#material", material);
        await second.waitForFunction((chosen) => document.getElementById("material").value === chosen, material);
        await untilFrames(second, 10);
        const colour = await clothColour(second, await takePixels(second, `material_${material}`));
        assert.ok(fits(colour), `${material} has the colour ${colour.map(Math.round)}`);
      }
    }),
  ));

for (const scene of scenes) {
  test(`the first view of ${scene.name} shows all of its cloths`, () =>
    withPage({ query: `?scene=${scene.name}`, viewport: kSmall }, async (page) => {
      await untilState(page, "live");
      const outside = () =>
        page.evaluate(() => {
          const { positions, restPositions, canvas, project } = window.clothstream;
          const frame = canvas.getBoundingClientRect();
          const count = (vertices) => {
            let out = 0;
            for (let i = 0; i < vertices.length; i += 3) {
              const [x, y] = project(Array.from(vertices.slice(i, i + 3)));
              if (!(x >= frame.left && x <= frame.right && y >= frame.top && y <= frame.bottom)) ++out;
            }
            return out;
          };
          return { rest: count(restPositions), now: count(positions), vertices: positions.length / 3 };
        });
      const first = await outside();
      assert.ok(first.vertices > 0);
      assert.equal(first.rest, 0, `${first.rest} of ${first.vertices} vertices at rest are outside`);
      const ticks = kSeconds * (scene.simulationRate ?? 72);
      await page.waitForFunction((end) => window.clothstream.statistics.tick >= end, ticks);
      const later = await outside();
      assert.equal(later.now, 0, `${later.now} of ${later.vertices} vertices are outside after ${kSeconds} s`);
      await takePicture(page, `scene_${scene.name}`);
    }));
}

test("the room follows the preferred colour scheme, also while it is shown", () =>
  withPage({ viewport: kSmall, scheme: "light" }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 5);
    // The cards are hidden, so that the whole picture is the room and the cloth.
    await page.addStyleTag({ content: ".card { display: none !important; }" });
    const meanOf = (picture) => {
      let sum = 0;
      for (let y = 0; y < picture.height; y += 5) for (let x = 0; x < picture.width; x += 5) sum += luminance(picture.colourAt(x, y));
      return sum / (Math.ceil(picture.height / 5) * Math.ceil(picture.width / 5));
    };
    const light = meanOf(await takePixels(page, "light"));
    await page.emulateMedia({ colorScheme: "dark" });
    await untilFrames(page, 5);
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    const dark = meanOf(await takePixels(page, "dark"));
    assert.ok(light > 130 && dark < 90, `the mean luminance is ${light} in light and ${dark} in dark`);
  }));

test("reduced detail shows the same scene", () =>
  withPage({ query: "?detail=reduced", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 60);
    const [red, , blue] = await clothColour(page, await takePixels(page, "reduced"));
    assert.ok(red > blue + 40, `silk has red ${red} and blue ${blue}`);
  }));

test("another participant has a head of any size, hands and a name; a ball is no head", () =>
  withPage({ query: "?name=Ada", viewport: kPicture }, async (page) => {
    await untilState(page, "live");
    await untilFrames(page, 30);
    // A person whose scene is twice as large has a head of half the size.
    const head = { position: [-0.75, 1.66, 0.3], orientation: [0, -0.5, 0, 0.866], radius: 0.055 };
    const ball = [-0.6, 1.9, 0.3, 0.12];
    const wrists = [
      { side: 1, wrist: [-0.6, 1.25, 0.05] },
      { side: 2, wrist: [-0.85, 1.2, 0.45] },
    ];
    const places = [head.position, ...wrists.map(({ wrist: [x, y, z] }) => [x, y - 0.01, z - 0.08])];
    const coloursNow = async (name) => {
      const picture = await takePixels(page, name);
      const points = await page.evaluate((all) => all.map((point) => window.clothstream.project(point)), places);
      return points.map(([x, y]) => picture.colourAt(x, y));
    };
    const before = await coloursNow("alone");
    assert.deepEqual(await page.evaluate(() => window.clothstream.people), []);
    const guest = await joinAsGuest(browser, server.url, { scene: "", name: "Grace Hopper", head, hands: wrists, ball });
    try {
      await page.waitForFunction(() => window.clothstream.people.length === 1);
      const [person] = await page.evaluate(() => window.clothstream.people);
      assert.equal(person.name, "Grace Hopper");
      const [x, y, z] = person.label;
      assert.ok(Math.hypot(x - head.position[0], z - head.position[2]) < 0.01 && y > head.position[1] + head.radius, `the name is at ${person.label}`);
      const after = await coloursNow("guest");
      after.forEach((colour, i) => {
        const change = Math.hypot(...colour.map((value, channel) => value - before[i][channel]));
        assert.ok(change > 25, `place ${i} changed by ${change}: ${before[i]} to ${colour}`);
      });
    } finally {
      await guest.close();
    }
    // The server keeps colliders of a lost connection for 2 s.
    await page.waitForFunction(() => window.clothstream.people.length === 0);
  }));

// Runs in a page before its own scripts: remembers when it has drawn first, and how many frames of the stream it had.
function watchFirstDraw() {
  const draw = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (...given) {
    window.firstDraw ??= { atMs: performance.now(), frames: window.clothstream?.statistics?.frames ?? 0, isComplete: window.clothstream.isComplete };
    draw.apply(this, given);
  };
}
const kWaitMs = 1000; // view.ts

test("the first picture waits for a frame of the stream for a second, and all detail follows", () =>
  withPage({ prepare: watchFirstDraw }, async (page) => {
    await untilState(page, "live");
    await page.waitForFunction(() => window.firstDraw !== undefined);
    const { frames, atMs, isComplete } = await page.evaluate(() => window.firstDraw);
    assert.ok(frames > 0 || atMs >= kWaitMs, `drawn after ${atMs} ms with ${frames} frames`);
    assert.ok(!isComplete);
    await page.waitForFunction(() => window.clothstream.isComplete);
  }));

test("the room is drawn although no frame comes", () =>
  withPage({ query: "?scene=nothing", prepare: watchFirstDraw }, async (page) => {
    await untilState(page, "failed");
    await page.waitForFunction(() => window.firstDraw !== undefined);
    const { frames, atMs } = await page.evaluate(() => window.firstDraw);
    assert.equal(frames, 0);
    assert.ok(atMs >= kWaitMs, `drawn after ${atMs} ms`);
  }));
