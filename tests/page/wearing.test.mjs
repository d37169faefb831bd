// SPDX-License-Identifier: MIT
// A user of an emulated headset wears the figure of the scene "walker": it follows the hands, elbows do not flip, a tunic
// that follows its joints stays on, and a mirror stands before it.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, takePicture, untilFrames, untilState } from "./browser.mjs";
import { enter, moveTo, openHeadset, pressButton } from "./headset.mjs";
import { startServer } from "./server.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
if (!existsSync(kChromium)) {
  console.log(`skipped: there is no ${kChromium} (apt install chromium)`);
  process.exit(kSkipped);
}

const kRightHand = 4; // BodyPart of @clothstream/client
const kHead = 1;

const kTorso = [0, 1]; // joints of the figure: hips and chest
const kBeside = 0.015; // m, of the tunic from the body
const kLoose = 0.03; // m, that nodes may leave their skinned places

// The scene "walker" with a tunic: the torso's surface, moved outwards. `bodyOf` has the vertex of the body of each node.
async function sceneWithTunic() {
  const scene = JSON.parse(await readFile(new URL("../../server/scenes/walker.json", import.meta.url), "utf8"));
  const { positions, triangles, skin } = scene.colliders[0].mesh;
  const four = (list, vertex) => list.slice(4 * vertex, 4 * vertex + 4);
  const point = (vertex) => positions.slice(3 * vertex, 3 * vertex + 3);
  const covered = (vertex) => {
    const weights = four(skin.vertexWeights, vertex);
    const joint = four(skin.vertexJoints, vertex)[weights.indexOf(Math.max(...weights))];
    const height = positions[3 * vertex + 1];
    return height > 0.92 && height < 1.3 && kTorso.includes(joint);
  };
  const normals = positions.map(() => 0);
  const corners = [];
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = triangles.slice(i, i + 3);
    const [u, v] = [b, c].map((to) => point(to).map((value, axis) => value - positions[3 * a + axis]));
    const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const corner of [a, b, c]) across.forEach((value, axis) => (normals[3 * corner + axis] += value));
    if ([a, b, c].every(covered)) corners.push(a, b, c);
  }
  const bodyOf = [...new Set(corners)];
  const nodeOf = new Map(bodyOf.map((vertex, node) => [vertex, node]));
  const places = bodyOf.flatMap((vertex) => {
    const normal = normals.slice(3 * vertex, 3 * vertex + 3);
    return point(vertex).map((value, axis) => value + (kBeside * normal[axis]) / Math.hypot(...normal));
  });
  const tunic = {
    name: "tunic",
    material: "cotton",
    thickness: 0.006,
    mesh: { positions: places, triangles: corners.map((corner) => nodeOf.get(corner)) },
    skin: {
      collider: "avatar",
      vertexJoints: bodyOf.flatMap((vertex) => four(skin.vertexJoints, vertex)),
      vertexWeights: bodyOf.flatMap((vertex) => four(skin.vertexWeights, vertex)),
      limits: { maxDistance: kLoose },
    },
  };
  return { scene: { ...scene, name: "dressed", cloths: [tunic] }, bodyOf };
}

let folder;
let bodyOf;
let server;
let browser;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-wearing-"));
  const made = await sceneWithTunic();
  bodyOf = made.bodyOf;
  const file = join(folder, "dressed.json");
  await writeFile(file, JSON.stringify(made.scene));
  server = await startServer(0, ["--scene", "dressed", "--scene-file", file]);
  browser = await launchBrowser();
});
after(async () => {
  await browser?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true });
});

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

// Runs in the page: the tracked wrist of the right hand, and the body's wrist, elbow and head.
function look() {
  const { limbs, worn } = window.clothstream.headset;
  const hand = limbs.find(({ side, isHand }) => side === "right" && isHand);
  const [wrist, elbow, head] = [4, 32, 1].map((part) => worn.part(part)?.position);
  return { tracked: hand?.joints.slice(0, 3), wrist, elbow, head };
}

// Largest distance of a node of the tunic from the nearest vertex of the drawn body below the tunic, or of such a vertex
// from the nearest node, m. Nodes of a stream are in another order than those of the scene's file.
async function farthestFromBody(page) {
  const { positions, body, place, turn } = await page.evaluate(() => {
    const { positions, drawnColliderVertices, colliders } = window.clothstream;
    const { position, orientation } = colliders.find(({ name }) => name === "avatar");
    return { positions: [...positions], body: [...drawnColliderVertices[0]], place: position, turn: orientation };
  });
  const [qx, qy, qz, w] = [-turn[0], -turn[1], -turn[2], turn[3]]; // from the scene to the collider
  const nodes = Array.from({ length: positions.length / 3 }, (_, node) => {
    const [px, py, pz] = [0, 1, 2].map((axis) => positions[3 * node + axis] - place[axis]);
    const [tx, ty, tz] = [2 * (qy * pz - qz * py), 2 * (qz * px - qx * pz), 2 * (qx * py - qy * px)];
    return [px + w * tx + qy * tz - qz * ty, py + w * ty + qz * tx - qx * tz, pz + w * tz + qx * ty - qy * tx];
  });
  const vertices = bodyOf.map((vertex) => body.slice(3 * vertex, 3 * vertex + 3));
  const away = (from, to) => from.map((point) => Math.min(...to.map((other) => distance(point, other))));
  return Math.max(...away(nodes, vertices), ...away(vertices, nodes));
}

// A node is kBeside from its vertex of the body when it is at its skinned place, which it leaves by at most kLoose and 1 %
// of it. Positions of the coarsest quality have errors of 2 mm along each axis. The user stands still, so that cloth and
// body are of one pose.
const kMost = kBeside + 1.01 * kLoose + 0.0035;

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
    assert.ok(away < kMost, `a node of the tunic is ${(100 * away).toFixed(1)} cm from its place of the body`);
    await takePicture(page, "vr_mirror");
    await page.evaluate(() => (window.device.primaryInputMode = "controller"));
    // A reset leaves the body to its wearer, and the tunic comes to it.
    await pressButton(page, "Reset");
    await untilFrames(page, 120);
    const later = await farthestFromBody(page);
    assert.ok(later < kMost, `after a reset, a node of the tunic is ${(100 * later).toFixed(1)} cm from its place of the body`);
    assert.equal(await page.evaluate(() => window.clothstream.headset.worn.name), "avatar");
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
    await second.waitForFunction(() => window.clothstream.headset.panel.buttons.some(({ text, isEnabled }) => text === "Wear avatar" && isEnabled));
  } finally {
    await second.context().close();
  }
});
