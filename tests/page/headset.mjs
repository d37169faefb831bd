// SPDX-License-Identifier: MIT
// Pages with an emulated headset (iwer), and its poses.

import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";

const packageFile = (name) => fileURLToPath(new URL(`../../clients/web/node_modules/${name}`, import.meta.url));
const kRuntime = packageFile("iwer/build/iwer.min.js");
const kRoom = packageFile("@iwer/sem/build/iwer-sem.min.js");
const kCapture = packageFile("@iwer/sem/captures/office_small.json");

// Opens a page whose browser has a headset. `room` adds a real room with surfaces. turned: the headset has another origin
// and direction than others in that room (otherOrigin).
// `prepare` runs in the page before its own scripts. Pages do not share a context.
export async function openHeadset(browser, url, { room = false, turned = false, input = "hand", viewport = { width: 640, height: 360 }, prepare } = {}) {
  const context = await browser.newContext({ viewport });
  await context.addInitScript({ path: kRuntime });
  if (room) {
    await context.addInitScript({ path: kRoom });
    const captured = JSON.parse(await readFile(kCapture, "utf8"));
    if (turned) for (const { locatable_META: pose } of captured.spatialEntities) turn(pose);
    await context.addInitScript(`window.captured = ${JSON.stringify(captured)}`);
  }
  await context.addInitScript((primary) => {
    const { XRDevice, metaQuest3 } = window.IWER;
    const device = new XRDevice(metaQuest3);
    // Chromium has an empty navigator.xr, which has to be replaced.
    device.installRuntime({ forceInstall: true });
    device.primaryInputMode = primary;
    // One eye: half the time to draw.
    device.stereoEnabled = false;
    device.position.set(0, 1.6, 0);
    if (window.captured) {
      device.installSEM(window.IWER_SEM.SyntheticEnvironmentModule);
      device.sem.loadEnvironment(window.captured);
    }
    window.device = device;
  }, input);
  if (prepare) await context.addInitScript(prepare);
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(String(error)));
  await page.goto(url);
  return page;
}

// Where a point of the room is for a headset that is `turned`.
export const otherOrigin = ([x, y, z]) => [z + 0.7, y, -x + 0.2];

function turn(pose) {
  const { position } = pose;
  const { x, y, z, w } = pose.orientation;
  [position.x, position.y, position.z] = otherOrigin([position.x, position.y, position.z]);
  // A quarter turn about y before the orientation.
  const s = Math.SQRT1_2;
  pose.orientation = { x: s * (x + z), y: s * (y + w), z: s * (z - x), w: s * (w - y) };
}

// Enters a mode by its button, and waits until frames are drawn. `shape` answers whether the shape of the real room may be
// sent: send or keep.
export async function enter(page, mode, shape = "keep") {
  const before = await page.evaluate(() => window.clothstream.headset.frames);
  await page.click(`#enter-${mode}`);
  if (mode === "ar") await page.click(`#room button[value="${shape}"]`);
  await page.waitForFunction((count) => window.clothstream.headset.frames > count + 3, before);
}

// Moves a hand or controller to a place in the room, at once or by at most `step` metres per drawn frame: a busy machine
// draws few of them. `kind` is hands or controllers. Returns what `watch`, a function of the page, returned after each
// frame.
export function moveTo(page, kind, side, place, step = Infinity, watch = "() => 0") {
  return page.evaluate(
    async ([inputs, which, goal, most, source]) => {
      const look = eval(`(${source})`);
      const { position } = window.device[inputs][which];
      const start = [position.x, position.y, position.z];
      const steps = Math.max(1, Math.ceil(Math.hypot(...goal.map((to, axis) => to - start[axis])) / most));
      const seen = [];
      for (let i = 1; i <= steps; ++i) {
        position.set(...start.map((from, axis) => from + ((goal[axis] - from) * i) / steps));
        const { frames } = window.clothstream.headset;
        while (window.clothstream.headset.frames < frames + 2) await new Promise((done) => setTimeout(done, 4));
        seen.push(look());
      }
      return seen;
    },
    [kind, side, place, step, String(watch)],
  );
}

// Point of the scene in the room.
export async function toRoom(page, [x, y, z]) {
  const m = await page.evaluate(() => window.clothstream.headset.placement);
  return [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}

export function untilSession(page, mode) {
  return page.waitForFunction((wanted) => (window.clothstream.headset.mode ?? "none") === wanted, mode);
}

// Position of a vertex in the newest frame, in the scene.
export const vertex = (page, index) => page.evaluate((at) => Array.from(window.clothstream.positions.slice(3 * at, 3 * at + 3)), index);

// Offset from the pose of an emulated hand to the point where its fingers meet, in the room.
export async function pinchOffset(page, side) {
  const { position, point } = await page.evaluate((which) => {
    const { x, y, z } = window.device.hands[which].position;
    const limb = window.clothstream.headset.limbs.find((one) => one.side === which && one.isHand);
    return { position: [x, y, z], point: limb.point };
  }, side);
  const there = await toRoom(page, point);
  return there.map((value, axis) => value - position[axis]);
}

// Brings the fingers of a hand to a point of the scene, with an offset in the room.
export async function reach(page, side, point, [dx, dy, dz] = [0, 0, 0], step = undefined, watch = undefined) {
  const offset = await pinchOffset(page, side);
  const [x, y, z] = await toRoom(page, point);
  return moveTo(page, "hands", side, [x + dx - offset[0], y + dy - offset[1], z + dz - offset[2]], step, watch);
}

// Closes (1) or opens (0) the fingers of the right hand, and waits until the page has seen it.
export async function pinch(page, value) {
  await page.evaluate((goal) => window.device.hands.right.updatePinchValue(goal), value);
  const { frames } = await page.evaluate(() => window.clothstream.headset);
  await page.waitForFunction((before) => window.clothstream.headset.frames > before + 3, frames);
}

// Deepest place of a drawn vertex in a joint of the own hand, metres. Runs in the page.
export function deepest() {
  const { drawn, headset } = window.clothstream;
  let most = 0;
  for (const { joints } of headset.limbs) {
    for (let j = 0; j < joints.length; j += 4) {
      for (let i = 0; i < drawn[0].length; i += 3) {
        const away = Math.hypot(drawn[0][i] - joints[j], drawn[0][i + 1] - joints[j + 1], drawn[0][i + 2] - joints[j + 2]);
        most = Math.max(most, joints[j + 3] - away);
      }
    }
  }
  return most;
}

// Waits until a button of the panel in space has a text, and returns it.
export async function panelButton(page, text) {
  await page.waitForFunction((wanted) => window.clothstream.headset.panel.buttons.some((one) => one.text === wanted), text);
  return page.evaluate((wanted) => window.clothstream.headset.panel.buttons.find((one) => one.text === wanted), text);
}

// Waits until a text of the panel in space matches, or has matched. Messages stay for a few seconds only, in which a busy
// machine draws few frames.
export function untilPanelText(page, pattern) {
  return page.waitForFunction((source) => {
    window.panelTexts ??= new Set();
    window.panelWatch ??= setInterval(() => window.panelTexts.add(window.clothstream.headset.panel.texts.join(" ")), 50);
    return [...window.panelTexts].some((text) => new RegExp(source).test(text));
  }, pattern.source);
}

// Points the right controller at a button of the panel in space, and pulls its trigger.
export async function pressButton(page, text) {
  const { place } = await panelButton(page, text);
  const origin = [place[0] + 0.2, place[1] - 0.1, place[2] + 0.25];
  await page.evaluate(
    ([from, to]) => {
      const { position, quaternion } = window.device.controllers.right;
      position.set(...from);
      // Shortest turn from -z to the button.
      const way = to.map((value, axis) => value - from[axis]);
      const length = Math.hypot(...way);
      const [x, y, z] = way.map((value) => value / length);
      const turn = [y, -x, 0, 1 - z];
      quaternion.set(...turn.map((value) => value / Math.hypot(...turn)));
    },
    [origin, place],
  );
  for (const value of [0, 1, 0]) {
    await page.evaluate((pull) => window.device.controllers.right.updateButtonValue("trigger", pull), value);
    const { frames } = await page.evaluate(() => window.clothstream.headset);
    await page.waitForFunction((before) => window.clothstream.headset.frames > before + 2, frames);
  }
}

const kIndexTip = 9; // joint of XRHand

// Moves the tip of the right index finger to `depth` metres behind a button of the panel in space. `eyes` is a point of
// the room in front of the panel.
export async function pokeButton(page, text, depth, eyes) {
  const { place } = await panelButton(page, text);
  const { hand, joints } = await page.evaluate(() => {
    const { x, y, z } = window.device.hands.right.position;
    return { hand: [x, y, z], joints: window.clothstream.headset.limbs.find(({ side, isHand }) => isHand && side === "right").joints };
  });
  const tip = await toRoom(page, joints.slice(4 * kIndexTip, 4 * kIndexTip + 3));
  const way = place.map((value, axis) => value - eyes[axis]);
  const length = Math.hypot(...way);
  return moveTo(page, "hands", "right", place.map((value, axis) => value + (depth * way[axis]) / length - tip[axis] + hand[axis]), 0.01);
}
