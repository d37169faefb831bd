// SPDX-License-Identifier: MIT
// Cloth on surfaces of a real room in emulated headsets, with a real server: a captured office, its desk, who may receive
// its shape, and what happens without it.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePicture, untilFrames, untilState, untilText } from "./browser.mjs";
import { enter, moveTo, openHeadset, otherOrigin, pinch, pinchOffset, toRoom, untilPanelText, untilSession } from "./headset.mjs";
import { writeFallingSheet } from "./scenes.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

// The desk of the captured office: height, and the front edge, in the room.
const kDesk = 0.74833;
const kDeskEdge = -0.27794;
const kFloor = 0.04879;
// Largest distance of resting cloth from the desk, m.
const kOnDesk = 0.005;
// Points that all headsets of the room touch: the origin of the scene, at the middle of the edge, and its x axis.
const kPoints = [[0.05, kDesk, kDeskEdge], [0.55, kDesk, kDeskEdge]];
// Vertices of the sheet in the scene: 25 rows along z from 0.18, each of 25 vertices 2.5 cm apart.
const kSide = 25;
// Rows that lie on the desk and are not bent by the edge: more than 8 cm behind it.
const kFirstOnDesk = 11;
// Row of the hanging end.
const kHanging = 0;

let folder;
let sceneFile;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-room-"));
  sceneFile = await writeFallingSheet(folder);
  server = await startServer(0, ["--scene-file", sceneFile, "--scene", "falling"]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

async function withHeadset(options, use) {
  const page = await openHeadset(browser, (options.url ?? server.url) + (options.query ?? ""), { room: true, ...options });
  try {
    await untilState(page, "live");
    await untilFrames(page, 3);
    await use(page);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
  }
}

// Touches the two points, so that the scene stands at the edge of the desk. `place` leads from the room to the headset's.
async function placeAtDesk(page, place = (point) => point) {
  // Fingers of a pinch meet a little elsewhere than those of an open hand.
  await pinch(page, 1);
  const offset = await pinchOffset(page, "right");
  await pinch(page, 0);
  await page.evaluate(() => window.clothstream.headset.choose("points"));
  for (const point of kPoints) {
    const at = place(point);
    await moveTo(page, "hands", "right", at.map((value, axis) => value - offset[axis]));
    await pinch(page, 1);
    await pinch(page, 0);
  }
  await page.waitForFunction(() => window.clothstream.headset.doing === "touch");
  // The hand is out of the way of the cloth.
  await moveTo(page, "hands", "right", place([0.9, 1.2, 0.6]));
}

const untilShared = (page) => page.waitForFunction(() => window.clothstream.headset.room.sent > 0 && window.clothstream.headset.room.sent === window.clothstream.headset.room.detected);

// Heights of the vertices above the origin of the scene, from the row `first` to the row before `end`.
const heights = (page, first, end) =>
  page.evaluate(([from, to]) => Array.from({ length: (to - from) / 3 }, (_, i) => window.clothstream.positions[from + 3 * i + 1]), [3 * kSide * first, 3 * kSide * end]);

// Waits until the cloth lies on the desk and is at rest.
async function untilItLies(page) {
  await page.waitForFunction(
    ([onDesk, end, most]) => {
      const { positions } = window.clothstream;
      const before = window.restBefore;
      window.restBefore = positions;
      if (!before) return false;
      for (let i = 0; i < positions.length; ++i) if (Math.abs(positions[i] - before[i]) > 5e-4) return false;
      for (let i = 3 * onDesk; i < 3 * end; i += 3) if (Math.abs(positions[i + 1]) > most) return false;
      return true;
    },
    [kSide * kFirstOnDesk, kSide * kSide, 4 * kOnDesk],
    { polling: 200 },
  );
}

const fall = (page, height) =>
  page.waitForFunction((most) => window.clothstream.positions.every((value, i) => i % 3 !== 1 || value < most), height);

test("a cloth lies on the real desk and hangs over its edge, for two headsets alike, and falls when the desk is gone", () =>
  withHeadset({ query: "?name=Ada" }, async (first) => {
    await enter(first, "ar", "send");
    await placeAtDesk(first);
    await untilShared(first);
    await first.evaluate(() => document.getElementById("scene-reset").click());
    await untilItLies(first);
    const lying = await heights(first, kFirstOnDesk, kSide);
    const [lowest, highest] = [Math.min(...lying), Math.max(...lying)];
    console.log(`${lying.length} vertices are ${(1000 * lowest).toFixed(2)} to ${(1000 * highest).toFixed(2)} mm above the desk`);
    assert.ok(lowest > 0 && highest < kOnDesk, `vertices are ${lowest} to ${highest} m above the desk`);
    const hanging = await heights(first, kHanging, kHanging + 1);
    assert.ok(Math.max(...hanging) < -0.08, `the hanging end is at ${Math.max(...hanging)}`);

    // Looks at the desk from the side.
    await first.evaluate(() => {
      window.device.position.set(0.5, 1.15, 0.25);
      const [yaw, pitch] = [0.55, -0.6];
      const [sy, cy, sp, cp] = [Math.sin(yaw / 2), Math.cos(yaw / 2), Math.sin(pitch / 2), Math.cos(pitch / 2)];
      window.device.quaternion.set(cy * sp, sy * cp, -sy * sp, cy * cp);
    });
    await untilFrames(first, 30);
    await takePicture(first, "ar_desk");

    await withHeadset({ query: "?name=Ben", turned: true }, async (second) => {
      await enter(second, "ar", "send");
      await placeAtDesk(second, otherOrigin);
      await untilShared(second);
      await untilItLies(second);
      // The surfaces of both headsets are one desk.
      const both = await heights(second, kFirstOnDesk, kSide);
      assert.ok(Math.min(...both) > 0 && Math.max(...both) < kOnDesk, `vertices are ${Math.min(...both)} to ${Math.max(...both)} m above the desk`);
      for (const vertex of [kSide * kSide - 1, kSide * (kSide - 6) + 12]) {
        const place = await second.evaluate((at) => Array.from(window.clothstream.positions.slice(3 * at, 3 * at + 3)), vertex);
        const [seen, also] = [otherOrigin(await toRoom(first, place)), await toRoom(second, place)];
        for (let axis = 0; axis < 3; ++axis) assert.ok(Math.abs(seen[axis] - also[axis]) < kOnDesk, `${seen} and ${also}`);
        assert.ok(also[1] - kDesk > -kOnDesk && also[1] - kDesk < 2 * kOnDesk, `the second headset sees the cloth at a height of ${also[1]}`);
      }
    });

    // The desk is carried away: its plane, its box and the scan of the room are gone.
    await first.evaluate(() => {
      const { trackedPlanes, trackedMeshes } = window.device.sem;
      for (const plane of trackedPlanes) if (plane.semanticLabel === "table") trackedPlanes.delete(plane);
      trackedMeshes.clear();
    });
    await fall(first, kFloor - kDesk + 0.05);
    const onFloor = await heights(first, 0, kSide);
    assert.ok(Math.min(...onFloor) > kFloor - kDesk, `the lowest vertex is ${Math.min(...onFloor)}, below the floor`);

    // Everything is taken back at the end, the floor too.
    await first.evaluate(() => window.device.activeSession.end());
    await untilSession(first, "none");
    await fall(first, kFloor - kDesk - 0.1);
  }));

test("the page asks before it sends the shape of the room, and takes it back", () =>
  withHeadset({}, async (page) => {
    await page.click("#enter-ar");
    await untilText(page, "#room-who", /The server 127\.0\.0\.1:\d+ uses the shape for the cloth, and sends it to no one/);
    await takePicture(page, "ar_consent");
    // Closing the question enters nothing.
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => !document.getElementById("room").open);
    assert.equal(await page.evaluate(() => window.clothstream.headset.mode), undefined);

    await enter(page, "ar", "keep");
    assert.deepEqual(await page.evaluate(() => window.clothstream.headset.room), { detects: false, shares: false, detected: 0, sent: 0 });
    assert.ok(await page.evaluate(() => !window.device.activeSession.enabledFeatures.some((name) => /plane|mesh/.test(name))), "the headset is not asked either");
    await page.evaluate(() => window.device.activeSession.end());
    await untilSession(page, "none");

    await enter(page, "ar", "send");
    await placeAtDesk(page);
    await untilShared(page);
    await page.evaluate(() => window.clothstream.headset.press("Room"));
    await untilPanelText(page, /The server has \d+ of \d+ surfaces of your room/);
    await takePicture(page, "ar_panel_room");
    await page.evaluate(() => window.clothstream.headset.press("Take back"));
    await page.waitForFunction(() => window.clothstream.headset.room.sent === 0);
    await untilPanelText(page, /The server has nothing of your room/);
    await page.evaluate(() => window.clothstream.headset.press("Send the shape of my room"));
    await untilShared(page);
  }));

// Runs in the page before its own scripts: the headset has these features no more.
function refuseDetection() {
  const ask = navigator.xr.requestSession.bind(navigator.xr);
  navigator.xr.requestSession = (mode, options) => ask(mode, { ...options, optionalFeatures: options.optionalFeatures.filter((name) => !/plane|mesh/.test(name)) });
}

test("a headset that refuses the shape of the room is no error", () =>
  withHeadset({ prepare: refuseDetection }, async (page) => {
    await enter(page, "ar", "send");
    await page.evaluate(() => window.clothstream.headset.press("Room"));
    await untilPanelText(page, /Your headset gives no shape of the room/);
    assert.deepEqual(await page.evaluate(() => window.clothstream.headset.room), { detects: false, shares: false, detected: 0, sent: 0 });
    await untilFrames(page, 5);
  }));

test("a server that takes no surfaces is not offered any", async () => {
  const other = await startServer(0, ["--scene-file", sceneFile, "--scene", "falling", "--room-surfaces", "off"]);
  try {
    await withHeadset({ url: other.url }, async (page) => {
      await page.click("#enter-ar");
      await untilSession(page, "immersive-ar");
      assert.equal(await page.evaluate(() => document.getElementById("room").open), false);
      assert.equal(await page.evaluate(() => window.clothstream.headset.room.detects), false);
    });
  } finally {
    await other.stop();
  }
});

test("with the policy everyone, others see the room, and the page says so before", async () => {
  const other = await startServer(0, ["--scene-file", sceneFile, "--scene", "falling", "--room-surfaces", "everyone"]);
  try {
    const watcher = await openPage(browser, `${other.url}?name=Watcher`, { draws: false });
    await untilState(watcher, "live");
    await withHeadset({ url: other.url }, async (page) => {
      await page.click("#enter-ar");
      await untilText(page, "#room-who", /sends it to everyone who is in the scene "falling" or joins it/);
      await page.keyboard.press("Escape");
      await enter(page, "ar", "send");
      await placeAtDesk(page);
      await untilShared(page);
      const { sent } = await page.evaluate(() => window.clothstream.headset.room);
      await watcher.waitForFunction((wanted) => window.clothstream.roomSurfaces === wanted, sent);
      // A page that joins later gets them too.
      const late = await openPage(browser, `${other.url}?name=Late`);
      await late.waitForFunction((wanted) => window.clothstream?.roomSurfaces === wanted, sent);
      await takePicture(late, "room_of_another");
      await late.close();
      assert.equal(await page.evaluate(() => window.clothstream.roomSurfaces), 0, "the own room is not drawn as that of another");
      await page.evaluate(() => window.device.activeSession.end());
      await watcher.waitForFunction(() => window.clothstream.roomSurfaces === 0);
    });
    await watcher.close();
  } finally {
    await other.stop();
  }
});
