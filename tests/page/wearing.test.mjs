// SPDX-License-Identifier: MIT
// A user of an emulated headset wears the body of the scene "dress": it follows the hands, elbows do not flip, the dress
// stays on, and a mirror stands before it.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, takePicture, untilFrames, untilState } from "./browser.mjs";
import { enter, moveTo, openHeadset, pressButton } from "./headset.mjs";
import { startServer } from "./server.mjs";

const kScene = new URL("../../server/scenes/dress.json", import.meta.url);

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kRightHand = 4; // BodyPart of @clothstream/client
const kHead = 1;

let server;
let browser;
before(async () => {
  server = await startServer(0, ["--scene", "dress"]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

// Runs in the page: the tracked wrist of the right hand, and the body's wrist, elbow and head.
function look() {
  const { limbs, worn } = window.clothstream.headset;
  const hand = limbs.find(({ side, isHand }) => side === "right" && isHand);
  const [wrist, elbow, head] = [4, 32, 1].map((part) => worn.part(part)?.position);
  return { tracked: hand?.joints.slice(0, 3), wrist, elbow, head };
}

// Nodes of the bodice may leave their skinned places by at most this distance, m.
const kTight = 0.03;
// A node keeps its distance from the nearest vertex of the body, except for kTight, the bend of the body's surface between
// vertices (edges of 3 to 5 cm), and the time between the frame of the cloth and the body that is drawn.
const kMost = kTight + 0.04;

// Largest growth of the distance from a node of the bodice to the nearest vertex of the body, m.
async function farthestFromBody(page) {
  const scene = JSON.parse(await readFile(kScene, "utf8"));
  const [{ mesh, skin }] = scene.cloths;
  const tight = skin.maxDistances.flatMap((most, node) => (most >= 0 && most <= kTight ? [node] : []));
  assert.ok(tight.length > 50, `${tight.length} nodes of the dress are tight`);
  const near = (points, x, y, z) => {
    let least = Infinity;
    for (let i = 0; i < points.length; i += 3) least = Math.min(least, Math.hypot(points[i] - x, points[i + 1] - y, points[i + 2] - z));
    return least;
  };
  const { positions, body, place, turn } = await page.evaluate(() => {
    const { positions, drawnColliderVertices, colliders } = window.clothstream;
    const [{ position, orientation }] = colliders.filter(({ name }) => name === "avatar");
    return { positions: [...positions], body: [...drawnColliderVertices[0]], place: position, turn: orientation };
  });
  const [qx, qy, qz, w] = [-turn[0], -turn[1], -turn[2], turn[3]]; // from the scene to the collider
  // Both meshes of the file are in the frame of the body.
  const rest = mesh.positions;
  const bodyAtRest = scene.colliders[0].mesh.positions;
  let most = -Infinity;
  for (const node of tight) {
    const [px, py, pz] = [0, 1, 2].map((axis) => positions[3 * node + axis] - place[axis]);
    const [tx, ty, tz] = [2 * (qy * pz - qz * py), 2 * (qz * px - qx * pz), 2 * (qx * py - qy * px)];
    const x = px + w * tx + qy * tz - qz * ty;
    const y = py + w * ty + qz * tx - qx * tz;
    const z = pz + w * tz + qx * ty - qy * tx;
    const before = near(bodyAtRest, rest[3 * node], rest[3 * node + 1], rest[3 * node + 2]);
    most = Math.max(most, near(body, x, y, z) - before);
  }
  return most;
}

test("a worn body follows the head and the hands, and a mirror shows it", async () => {
  const page = await openHeadset(browser, server.url, { input: "controller" });
  try {
    await untilState(page, "live");
    await untilFrames(page, 10);
    await enter(page, "vr");
    await pressButton(page, "Wear avatar");
    await page.waitForFunction(() => window.clothstream.headset.worn.name === "avatar" && window.clothstream.headset.worn.mirror);
    await page.evaluate(() => (window.device.primaryInputMode = "hand"));
    await page.waitForFunction((part) => window.clothstream.headset.worn.part(part), kRightHand);
    const places = [[0.25, 1.2, -0.35], [0.1, 1.45, -0.3], [0.45, 1.3, -0.1], [0.2, 0.95, -0.2], [0.3, 1.25, -0.3]];
    const seen = [];
    for (const place of places) seen.push(...(await moveTo(page, "hands", "right", place, 0.03, look)));
    const known = seen.filter(({ tracked, wrist }) => tracked && wrist);
    assert.ok(known.length > 20, `${known.length} of ${seen.length} frames show the hand`);
    // The arm of the body reaches all of these places. After 0.3 s the wrist has come to the hand that was not tracked.
    const settled = known.slice(Math.floor(known.length / 3));
    const worst = Math.max(...settled.map(({ tracked, wrist }) => distance(tracked, wrist)));
    assert.ok(worst < 0.02, `a wrist is ${(100 * worst).toFixed(1)} cm from the tracked one`);
    // A step of the hand of 3 cm moves the elbow of a bent arm by less than twice as much; a flip would move it by up to
    // twice its distance from the way of the arm, about 25 cm.
    for (let i = 1; i < settled.length; ++i) {
      const way = distance(settled[i].elbow, settled[i - 1].elbow);
      assert.ok(way < 0.12, `the elbow moved by ${(100 * way).toFixed(1)} cm in a frame`);
    }
    // The eyes are where the headset is, or lower if the user is taller than the body.
    const head = await page.evaluate((part) => window.clothstream.headset.worn.part(part).position, kHead);
    assert.ok(head[1] > 1.3 && head[1] < 1.7, `eyes at ${head[1]} m`);
    await untilFrames(page, 60);
    const away = await farthestFromBody(page);
    assert.ok(away < kMost, `a node of the bodice is ${(100 * away).toFixed(1)} cm farther from the body than at rest`);
    await takePicture(page, "vr_mirror");
    await page.evaluate(() => (window.device.primaryInputMode = "controller"));
    await pressButton(page, "Take off avatar");
    await page.waitForFunction(() => window.clothstream.headset.worn.name === "" && !window.clothstream.headset.worn.mirror);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
  }
});

test("two users do not wear the same body", async () => {
  const first = await openHeadset(browser, server.url, { input: "controller" });
  const second = await openHeadset(browser, server.url, { input: "controller" });
  try {
    for (const page of [first, second]) {
      await untilState(page, "live");
      await enter(page, "vr");
    }
    await pressButton(first, "Wear avatar");
    await first.waitForFunction(() => window.clothstream.headset.worn.name === "avatar");
    await second.waitForFunction(() => window.clothstream.headset.panel.buttons.some(({ text, isEnabled }) => text === "Wear avatar" && !isEnabled));
    await first.context().close();
    // A closed page may come back for 20 s (--hold-page).
    await second.waitForFunction(() => window.clothstream.headset.panel.buttons.some(({ text, isEnabled }) => text === "Wear avatar" && isEnabled));
  } finally {
    await second.context().close();
  }
});
