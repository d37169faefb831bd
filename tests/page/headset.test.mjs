// SPDX-License-Identifier: MIT
// The page in emulated headsets, with a real server: hands, controllers, grabs, pass-through, lost connections, two users.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, takePicture, untilFrames, untilState } from "./browser.mjs";
import {
  deepest, enter, moveTo, openHeadset, panelButton, pinch, pinchOffset, pokeButton, pressButton, reach, toRoom, untilPanelText,
  untilSession, vertex,
} from "./headset.mjs";
import { writeHangingSheet } from "./scenes.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kRows = 40;
const kColumns = 32;
// A vertex of the scene "swing" away from its rod.
const kTouched = 28 * kColumns + 16;

// Way of a hand from one drawn frame to the next, m.
const kStep = 0.02;

let folder;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-headset-"));
  server = await startServer(0, ["--scene-file", await writeHangingSheet(folder), "--scene", "hanging"]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

async function withHeadset(options, use) {
  const page = await openHeadset(browser, (options.url ?? server.url) + (options.query ?? ""), options);
  try {
    await untilState(page, "live");
    await untilFrames(page, 10);
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
  }
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

test("a hand pushes the cloth, and is never drawn inside it", () =>
  withHeadset({}, async (page) => {
    await enter(page, "vr");
    const start = await vertex(page, kTouched);
    await reach(page, "right", start, [0, 0, 0.2]);
    await untilFrames(page, 5);
    // Slowly, because the depth grows with the way of the hand until the next frame, which may be late.
    const depths = await reach(page, "right", start, [0, 0, -0.15], kStep / 2, deepest);
    await takePicture(page, "vr_push");
    await untilFrames(page, 20);
    const pushed = await vertex(page, kTouched);
    assert.ok(pushed[2] < start[2] - 0.05, `the touched vertex went from z = ${start[2]} to ${pushed[2]}`);
    assert.ok(depths.length > 3, `${depths.length} frames`);
    assert.ok(Math.max(...depths) < 0.005, `a vertex is drawn ${1000 * Math.max(...depths)} mm inside the hand`);
    // In the server's frame the hand is where the server knows it.
    const inside = await page.evaluate(() => {
      const { positions, colliders } = window.clothstream;
      let most = 0;
      for (const { participantId, shape, position, orientation, radius, length } of colliders) {
        if (participantId === 0n || shape !== 1) continue;
        const [x, y, z, w] = orientation;
        const axis = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)];
        for (let i = 0; i < positions.length; i += 3) {
          const way = [0, 1, 2].map((k) => positions[i + k] - position[k]);
          const along = Math.max(-length / 2, Math.min(length / 2, way[0] * axis[0] + way[1] * axis[1] + way[2] * axis[2]));
          most = Math.max(most, radius - Math.hypot(...way.map((value, k) => value - along * axis[k])));
        }
      }
      return most;
    });
    assert.ok(inside < 0.003, `a vertex is ${1000 * inside} mm inside the hand`);
  }));

// The fingers push the lower edge away while they close. The hand holds what was near, where it was.
test("a pinch takes hold of the cloth and lifts it", () =>
  withHeadset({}, async (page) => {
    await enter(page, "vr");
    const low = (kRows - 1) * kColumns + 16;
    const start = await vertex(page, low);
    // A hand that jumps into the cloth would strike it away.
    await reach(page, "right", start, [0, 0, 0.25]);
    await reach(page, "right", start, [0, 0, 0.02], kStep);
    await pinch(page, 1);
    await page.waitForFunction(() => window.clothstream.headset.limbs.some(({ holds }) => holds));
    const highest = (at) => page.evaluate((first) => Math.max(...Array.from({ length: 32 }, (_, i) => window.clothstream.positions[3 * (first + i) + 1])), at);
    const edge = (kRows - 1) * kColumns;
    const before = await highest(edge);
    const { x, y, z } = await page.evaluate(() => {
      const { x, y, z } = window.device.hands.right.position;
      return { x, y, z };
    });
    await moveTo(page, "hands", "right", [x, y + 0.3, z + 0.1], kStep);
    await untilFrames(page, 40);
    const lifted = await highest(edge);
    assert.ok(lifted > before + 0.2, `the lower edge went from y = ${before} to ${lifted}`);
    await takePicture(page, "vr_lift");
    await pinch(page, 0);
    // The open hand no longer carries the cloth.
    await moveTo(page, "hands", "right", [x, y, z + 0.5], kStep);
    await page.waitForFunction(
      ([first, height]) => Math.max(...Array.from({ length: 32 }, (_, i) => window.clothstream.positions[3 * (first + i) + 1])) < height,
      [edge, lifted - 0.1],
    );
  }));

test("a controller takes hold of the cloth by its ray", () =>
  withHeadset({ input: "controller" }, async (page) => {
    await enter(page, "vr");
    const target = await vertex(page, kTouched);
    const [x, y, z] = await toRoom(page, target);
    // The ray of the controller leads forwards.
    await moveTo(page, "controllers", "right", [x, y, z + 0.4]);
    await page.evaluate(() => window.device.controllers.right.updateButtonValue("trigger", 1));
    await page.waitForFunction(() => window.clothstream.headset.limbs.some(({ holds }) => holds));
    const before = await page.evaluate(() => Array.from(window.clothstream.positions));
    await moveTo(page, "controllers", "right", [x, y + 0.25, z + 0.5], kStep);
    await untilFrames(page, 40);
    const after = await page.evaluate(() => Array.from(window.clothstream.positions));
    const raised = Math.max(...after.map((value, i) => (i % 3 === 1 ? value - before[i] : 0)));
    assert.ok(raised > 0.1, `the highest rise is ${raised} m`);
    await page.evaluate(() => window.device.controllers.right.updateButtonValue("trigger", 0));
    await page.waitForFunction(() => window.clothstream.headset.limbs.every(({ holds }) => !holds));
  }));

// Number of pixels of the panel in space that have the colour of a plot.
function plotPixels() {
  const { canvas } = window.clothstream.headset.panel;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i] > 200 && data[i + 1] > 140 && data[i + 1] < 190 && data[i + 2] < 110) ++count;
  return count;
}

// The user stays in VR and connected throughout.
test("rays press the panel in space: people, quality, figures, pause, reset, and another scene", () =>
  withHeadset({ input: "controller", query: "?name=Ada" }, async (page) => {
    await enter(page, "vr");
    await page.waitForFunction(() => window.clothstream.headset.limbs.length === 2);
    await page.evaluate(() => window.device.quaternion.set(0, 0.5, 0, Math.sqrt(0.75)));
    // A busy machine says instead that frames are late.
    await untilPanelText(page, /\d+ frames\/s, round trip \d+ ms|Frames arrive late/);
    await takePicture(page, "vr_panel_scenes");
    await pressButton(page, "People");
    await untilPanelText(page, /Ada \(you\)/);
    await takePicture(page, "vr_panel_people");

    await pressButton(page, "Quality");
    assert.equal((await panelButton(page, "finest")).isChosen, true);
    await takePicture(page, "vr_panel_quality");
    await pressButton(page, "a quarter");
    await page.waitForURL(/quality=2/);
    await untilState(page, "live");
    await untilFrames(page, 3);
    assert.equal((await panelButton(page, "a quarter")).isChosen, true);

    const without = await page.evaluate(plotPixels);
    await pressButton(page, "Figures");
    await page.waitForFunction(([source, before]) => eval(`(${source})`)() > before + 200, [String(plotPixels), without]);
    await takePicture(page, "vr_panel_figures");

    await pressButton(page, "Scenes");
    await pressButton(page, "Pause");
    await panelButton(page, "Continue");
    await untilPanelText(page, /[Pp]aused/);
    await pressButton(page, "Continue");
    await panelButton(page, "Pause");
    await pressButton(page, "Reset");
    await untilPanelText(page, /back at its start|reset/);

    await pressButton(page, "curtain");
    await page.waitForFunction(() => window.clothstream.cloths[0]?.name !== "sheet" && window.clothstream.state === "live");
    assert.equal((await panelButton(page, "curtain")).isChosen, true);
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 3);
    // Scenes that do not fit are on further pages.
    await pressButton(page, "More");
    await page.waitForFunction(() => window.clothstream.headset.panel.buttons.every(({ text }) => text !== "curtain"));
    await untilPanelText(page, /2 of \d/);
    await pressButton(page, "Back");
    await panelButton(page, "curtain");
    assert.equal(await page.evaluate(() => window.clothstream.headset.mode), "immersive-vr");
    await pressButton(page, "Leave").catch(() => undefined);
    await untilSession(page, "none");
  }));

test("a finger presses the panel in space by going through it", () =>
  withHeadset({}, async (page) => {
    await enter(page, "vr");
    await page.waitForFunction(() => window.clothstream.headset.limbs.length === 2);
    const eyes = [0, 1.5, 0];
    await pokeButton(page, "Quality", -0.1, eyes);
    await pokeButton(page, "Quality", -0.02, eyes);
    assert.equal((await panelButton(page, "Quality")).isChosen, false, "a finger in front of the panel presses nothing");
    await pokeButton(page, "Quality", 0.015, eyes);
    assert.equal((await panelButton(page, "Quality")).isChosen, true);
    await pokeButton(page, "Quality", -0.05, eyes);
    await pokeButton(page, "half as fine", -0.05, eyes);
    await takePicture(page, "vr_panel_finger");
    await pokeButton(page, "half as fine", 0.015, eyes);
    await page.waitForURL(/quality=1/);
    await untilState(page, "live");
    assert.equal(await page.evaluate(() => window.clothstream.headset.mode), "immersive-vr");
  }));

test("viewers cannot press what changes the scene", async () => {
  const owner = await openHeadset(browser, server.url);
  try {
    await untilState(owner, "live");
    await withHeadset({ query: "?role=viewer", input: "controller" }, async (page) => {
      await enter(page, "vr");
      assert.equal((await panelButton(page, "Reset")).isEnabled, false);
      assert.equal((await panelButton(page, "Pause")).isEnabled, false);
      assert.equal((await panelButton(page, "curtain")).isEnabled, true);
    });
  } finally {
    await owner.context().close();
  }
});

test("a lost hand keeps its pose for a moment, then goes, and comes back", () =>
  withHeadset({}, async (page) => {
    await enter(page, "vr");
    const capsules = () => page.evaluate(() => window.clothstream.colliders.filter(({ participantId, shape }) => participantId !== 0n && shape === 1).length);
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 41);
    const held = await page.evaluate(async () => {
      const isThere = () => window.clothstream.headset.limbs.some(({ side }) => side === "left");
      const { headset } = window.clothstream;
      const began = performance.now();
      // The second frame from now starts after this moment, so the hand is seen after it too.
      while (window.clothstream.headset.frames < headset.frames + 2) await new Promise((done) => setTimeout(done, 1));
      window.device.hands.left.connected = false;
      while (isThere()) await new Promise((done) => setTimeout(done, 5));
      return performance.now() - began;
    });
    assert.ok(held >= 300, `the hand stayed for ${held} ms`);
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 21);
    await page.evaluate(() => (window.device.hands.left.connected = true));
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 41);
    assert.equal(await capsules(), 40);
    // Controllers instead of hands, and back.
    await page.evaluate(() => (window.device.primaryInputMode = "controller"));
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 3);
    await page.evaluate(() => (window.device.primaryInputMode = "hand"));
    await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 41);
  }));

test("a session ends, and another one begins", () =>
  withHeadset({}, async (page) => {
    const own = (count) =>
      page.waitForFunction((wanted) => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === wanted, count);
    for (let session = 0; session < 2; ++session) {
      await enter(page, "vr");
      await own(41);
      // The headset is taken off, and put on again.
      await page.evaluate(() => window.device.updateVisibilityState("hidden"));
      await own(0);
      await page.evaluate(() => window.device.updateVisibilityState("visible"));
      const { frames } = await page.evaluate(() => window.clothstream.headset);
      await page.waitForFunction((before) => window.clothstream.headset.frames > before, frames);
      await page.evaluate(() => window.device.activeSession.end());
      await untilSession(page, "none");
      await own(0);
      await untilState(page, "live");
    }
    await takePicture(page, "after_vr");
  }));

test("the connection returns while the user stays in VR", async () => {
  let other = await startServer(0, ["--scene", "curtain"]);
  try {
    await withHeadset({ url: other.url }, async (page) => {
      await enter(page, "vr");
      await other.stop();
      await untilState(page, "reconnecting");
      const { mode, frames } = await page.evaluate(() => window.clothstream.headset);
      assert.equal(mode, "immersive-vr");
      await page.waitForFunction((before) => window.clothstream.headset.frames > before + 3, frames);
      // The panel comes before the eyes and says what happens.
      await page.waitForFunction(() => {
        const { texts, buttons } = window.clothstream.headset.panel;
        return /comes back by itself/.test(texts.join(" ")) && buttons.map(({ text }) => text).join() === "Try now,Leave";
      });
      const { place } = await page.evaluate(() => window.clothstream.headset.panel);
      // The camera is one eye, 3 cm from the middle.
      assert.ok(distance(place, [0, 1.5, -0.7]) < 0.04, `the panel is at ${place}`);
      await takePicture(page, "vr_lost");
      other = await startServer(other.port, ["--scene", "curtain"]);
      await untilState(page, "live");
      await untilFrames(page, 10);
      assert.equal(await page.evaluate(() => window.clothstream.headset.mode), "immersive-vr");
      await page.waitForFunction(() => window.clothstream.colliders.filter(({ participantId }) => participantId !== 0n).length === 41);
      await page.waitForFunction(() => window.clothstream.headset.panel.buttons.some(({ text }) => text === "Place before me"));
      assert.ok((await page.evaluate(() => window.clothstream.headset.panel.place[0])) < -0.5, "the panel is at its place again");
    });
  } finally {
    await other.stop();
  }
});

test("pass-through: the scene is put on a real surface", () =>
  withHeadset({ room: true, input: "controller" }, async (page) => {
    await enter(page, "ar");
    await page.waitForFunction(() => window.clothstream.headset.doing === "place");
    // The user looks down at the floor before them.
    await page.evaluate(() => {
      const half = -Math.PI / 7;
      window.device.quaternion.set(Math.sin(half), 0, 0, Math.cos(half));
    });
    const { frames } = await page.evaluate(() => window.clothstream.headset);
    await page.waitForFunction((before) => window.clothstream.headset.frames > before + 3, frames);
    await page.evaluate(() => window.device.controllers.right.updateButtonValue("trigger", 1));
    await page.waitForFunction(() => window.clothstream.headset.doing === "touch");
    await page.evaluate(() => window.device.controllers.right.updateButtonValue("trigger", 0));
    await page.waitForFunction(() => window.clothstream.headset.isAnchored);
    await takePicture(page, "ar_placed");
    const placement = await page.evaluate(() => window.clothstream.headset.placement);
    // The user may turn away: the scene stays.
    await page.evaluate(() => window.device.quaternion.set(0, 0, 0, 1));
    await page.waitForTimeout(500);
    const later = await page.evaluate(() => window.clothstream.headset.placement);
    for (let i = 0; i < 16; ++i) assert.ok(Math.abs(placement[i] - later[i]) < 1e-3, `element ${i}: ${placement[i]} and ${later[i]}`);
    // Both hands move, turn and scale it, and its shadows with it.
    const { shadowReach } = await page.evaluate(() => window.clothstream.headset);
    await page.evaluate(() => {
      const { left, right } = window.device.controllers;
      left.position.set(-0.2, 0.3, 1);
      right.position.set(0.2, 0.3, 1);
      left.updateButtonValue("squeeze", 1);
      right.updateButtonValue("squeeze", 1);
    });
    const seen = await page.evaluate(() => window.clothstream.headset.frames);
    await page.waitForFunction((before) => window.clothstream.headset.frames > before + 3, seen);
    await moveTo(page, "controllers", "right", [0.6, 0.3, 1]);
    await page.waitForFunction((scale) => {
      const m = window.clothstream.headset.placement;
      return Math.abs(Math.hypot(m[0], m[1], m[2]) - scale) < 0.05;
    }, 2);
    await page.waitForFunction((reach) => {
      const { placement: m, shadowReach: now } = window.clothstream.headset;
      return Math.abs(now / reach / Math.hypot(m[0], m[1], m[2]) - 1) < 0.001;
    }, shadowReach);
  }));

// Both headsets have an origin and a direction of their own: the second one is turned by a quarter and moved.
test("two headsets see each other, and agree on one placement by two points", () =>
  withHeadset({ query: "?name=Ada" }, (first) =>
    withHeadset({ query: "?name=Ben" }, async (second) => {
      await enter(first, "vr");
      await enter(second, "vr");
      for (const page of [first, second])
        await page.waitForFunction(() => new Set(window.clothstream.colliders.map(({ participantId }) => participantId)).size === 2);
      const names = await first.evaluate(() => window.clothstream.participants.map(({ name }) => name));
      assert.deepEqual(names.sort(), ["Ada", "Ben"]);

      const points = [[0.4, 0.9, -0.3], [-0.5, 0.9, -0.6]];
      const there = ([x, y, z]) => [z + 0.7, y - 0.1, -x + 0.2]; // from the first room to the second
      for (const [page, place] of [[first, (point) => point], [second, there]]) {
        // Fingers of a pinch meet a little elsewhere than those of an open hand.
        await pinch(page, 1);
        const offset = await pinchOffset(page, "right");
        await pinch(page, 0);
        await page.evaluate(() => window.clothstream.headset.choose("points"));
        for (const point of points) {
          const at = place(point);
          await moveTo(page, "hands", "right", at.map((value, axis) => value - offset[axis]));
          await pinch(page, 1);
          await pinch(page, 0);
        }
        await page.waitForFunction(() => window.clothstream.headset.doing === "touch");
      }
      for (const point of [[0, 0, 0], [1, 1, 1], [-1, 2, 0.5]]) {
        const seen = there(await toRoom(first, point));
        const also = await toRoom(second, point);
        assert.ok(distance(seen, also) < 0.01, `${point} is at ${seen} and ${also}`);
      }
    }),
  ));
