// SPDX-License-Identifier: MIT
// Logic of the panel without a browser: pins and places of meshes, numbers, wind, figures.

import { assert, test } from "vitest";
import { kClothParameters, kSettings } from "@clothstream/client";
import { drawHud, hudText, kHudHeight, kHudWidth } from "../../../clients/web/page/src/panel/hud_drawing";
import { HudHistory, kChannels, kStages, type Sample } from "../../../clients/web/page/src/panel/hud_history";
import { LinkCounter } from "../../../clients/web/page/src/panel/link_counts";
import { numberText, placeOf, powerOf, valueAt } from "../../../clients/web/page/src/panel/number_row";
import { checkGltf } from "../../../clients/web/page/src/panel/gltf_header";
import { PinSet } from "../../../clients/web/page/src/panel/pin_set";
import { boundsOf, centred, likelySize, misfitOf, nameFor, pinsOf, placeOf as meshPlace, within, type PinBox } from "../../../clients/web/page/src/panel/pins";
import { vectorOf, windOf } from "../../../clients/web/page/src/panel/wind";

// 3 x 3 vertices, 2 m wide and 1 m high, in the plane of two axes.
function sheet(right: number, up: number): Float32Array {
  const positions = new Float32Array(27);
  for (let i = 0; i < 9; ++i) {
    positions[3 * i + right] = (i % 3) - 1;
    positions[3 * i + up] = 1 - Math.floor(i / 3) / 2;
  }
  return positions;
}

const kWhole: PinBox = [[0, 1], [0, 1], [0, 1]];

test("pins are on the upper edge, at its ends, at the corners, or in a box", () => {
  const hanging = sheet(0, 1);
  assert.deepEqual(pinsOf(hanging, "top", kWhole), [0, 1, 2]);
  assert.deepEqual(pinsOf(hanging, "topCorners", kWhole), [0, 2]);
  assert.deepEqual(pinsOf(hanging, "corners", kWhole), [0, 2, 6, 8]);
  assert.deepEqual(pinsOf(hanging, "box", kWhole), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
  assert.deepEqual(pinsOf(hanging, "box", [[0, 1], [0.5, 1], [0, 1]]), [0, 1, 2, 3, 4, 5]);
  assert.deepEqual(pinsOf(hanging, "box", [[0.5, 1], [0, 0.6], [0, 1]]), [4, 5, 7, 8]);
  assert.deepEqual(pinsOf(hanging, "box", [[0.6, 0.4], [0, 1], [0, 1]]), []);
  assert.deepEqual(pinsOf(hanging, "none", kWhole), []);
  assert.deepEqual(pinsOf(new Float32Array(), "top", kWhole), []);
  // A sheet that lies flat has four corners, and is at one height.
  assert.deepEqual(pinsOf(sheet(0, 2), "corners", kWhole), [0, 2, 6, 8]);
  assert.equal(pinsOf(sheet(0, 2), "top", kWhole).length, 9);
  // A sheet along z has its ends there.
  assert.deepEqual(pinsOf(sheet(2, 1), "topCorners", kWhole), [0, 2]);
});

test("the brush finds the vertices in a ball", () => {
  assert.deepEqual(within(sheet(0, 1), [0, 1, 0], 1.01), [0, 1, 2, 4, 7]);
  assert.deepEqual(within(sheet(0, 1), [0, 1, 0.9], 1), [1]);
  assert.deepEqual(within(sheet(0, 1), [0, 1, 0], 0), [1]);
  assert.deepEqual(within(sheet(0, 1), [0, 1, 2], 1), []);
});

test("strokes pin and free vertices, and are undone one by one", () => {
  const pins = new PinSet(10, [3, 3, 5]);
  assert.deepEqual([...pins.list()], [3, 5]);
  assert.equal(pins.canUndo, false);
  assert.equal(pins.paint([1], true), false, "there is no stroke");
  pins.begin();
  assert.equal(pins.paint([1, 2, 3], true), true);
  assert.equal(pins.paint([2, 3], true), false);
  pins.end();
  pins.begin();
  pins.paint([1, 5, 9], false);
  pins.paint([1], true);
  pins.end();
  assert.deepEqual([...pins.list()], [1, 2, 3]);
  pins.replace([0, 9]);
  assert.equal(pins.count, 2);
  pins.undo();
  assert.deepEqual([...pins.list()], [1, 2, 3]);
  pins.undo();
  assert.deepEqual([...pins.list()], [1, 2, 3, 5]);
  pins.begin();
  pins.paint([7], true);
  pins.cancel();
  assert.deepEqual([...pins.list()], [1, 2, 3, 5], "a cancelled stroke leaves nothing");
  pins.undo();
  assert.deepEqual([...pins.list()], [3, 5]);
  pins.undo();
  assert.deepEqual([...pins.list()], [3, 5]);
  assert.equal(pins.canUndo, false);
});

test("undo goes back at most 100 strokes", () => {
  const pins = new PinSet(150);
  for (let vertex = 0; vertex < 150; ++vertex) {
    pins.begin();
    pins.paint([vertex], true);
    pins.end();
  }
  while (pins.canUndo) pins.undo();
  assert.equal(pins.count, 50);
});

test("a mesh that does not fit the world is found, with its size", () => {
  const triangles = Uint32Array.from([0, 3, 1]);
  assert.equal(misfitOf(sheet(0, 1), triangles, 1), undefined);
  assert.match(misfitOf(sheet(0, 1), triangles, 1500) ?? "", /^is 3,000 x 1,500 x 0 m large and reaches 1,500 m from the origin; the world ends at 1,000 m\.$/);
  assert.match(misfitOf(sheet(0, 1).map((value) => value + 1200), triangles, 1) ?? "", /^is 2 x 1 x 0 m large and reaches 1,200 m/);
  assert.match(misfitOf(sheet(0, 1), triangles, 1e-5) ?? "", /^has edges with a mean length of 0\.00873 mm; at least 0\.1 mm are needed\.$/);
  assert.deepEqual(centred({ min: [1, 2, 3], max: [3, 3, 3] }), { min: [-1, -0.5, -0], max: [1, 0.5, 0] });
});

const text = (json: unknown): ArrayBuffer => Uint8Array.from(Buffer.from(JSON.stringify(json))).buffer;
const primitive = { attributes: { POSITION: 0 }, indices: 1 };

test("glTF that cannot be read is named before it is decoded", () => {
  const asset = { version: "2.0" };
  const check = (json: unknown) => () => checkGltf(text(json), "a.gltf", 1000);
  check({ asset, accessors: [{ count: 1000 }, { count: 3 }], meshes: [{ primitives: [primitive] }] })();
  assert.throws(check({ asset: { version: "1.0" } }), /a\.gltf is glTF 1\.0, which is not supported\. Convert it to glTF 2\.0/);
  assert.throws(check({}), /glTF 1\.0/);
  assert.throws(check({ asset: { version: "3.1" } }), /is glTF 3\.1/);
  for (const extension of ["EXT_meshopt_compression", "KHR_meshopt_compression"])
    assert.throws(check({ asset, extensionsUsed: [extension] }), /compressed with meshopt, which is not supported/);
  assert.throws(check({ asset, accessors: [{ count: 501 }], meshes: [{ primitives: [primitive, primitive] }] }), /more than 1,000 vertices/);
  assert.throws(check({ asset, accessors: [{ count: 3 }, { count: 6001 }], meshes: [{ primitives: [primitive] }] }), /more than 1,000 vertices/);
  assert.throws(check({ asset, accessors: [{ count: "many" }], meshes: [{ primitives: [primitive] }] }), /more than/);
  assert.throws(() => checkGltf(text([]).slice(0, 1), "a.gltf", 1), /cannot be read/);
  const old = new Uint32Array([0x46546c67, 1, 20, 0, 0]).buffer;
  assert.throws(() => checkGltf(old, "a.glb", 1), /a\.glb is glTF 1\.0/);
});

test("all vertices in a pinned place are pinned", () => {
  const positions = new Float32Array([...sheet(0, 1), -1, 1, 0]);
  assert.deepEqual(pinsOf(positions, "topCorners", kWhole), [0, 2, 9]);
});

test("a pinned mesh hangs below 2 m, and another one starts 1 m above the floor", () => {
  const bounds = boundsOf(new Float32Array([10, 20, 30, 12, 24, 30]));
  assert.deepEqual(bounds, { min: [10, 20, 30], max: [12, 24, 30] });
  assert.deepEqual(meshPlace(bounds, 0.25, true), [-2.75, -4, -7.5]); // 1 m high: from 1 m to 2 m
  assert.deepEqual(meshPlace(bounds, 0.25, false), [-2.75, -4, -7.5]);
  assert.deepEqual(meshPlace(bounds, 1, true), [-11, -19.9, -30]); // 4 m high: just above the floor
});

test("sizes and names follow from the file where they can", () => {
  assert.equal(likelySize(1.23456), 1.23);
  assert.equal(likelySize(180), 1.5);
  assert.equal(likelySize(0.001), 1.5);
  assert.equal(nameFor("Rock & Röll (final).OBJ"), "rock_ro_ll_final");
  assert.equal(nameFor("布.glb"), "cloth");
  assert.ok(nameFor("x".repeat(100)).length === 64);
});

test("sliders reach both ends of every range and keep three digits", () => {
  for (const range of [...kClothParameters, ...Object.values(kSettings)]) {
    assert.ok(powerOf(range) >= 1);
    assert.equal(valueAt(range, 0), range.min);
    assert.equal(valueAt(range, 1), range.max);
    for (const value of [range.min, range.max, (range.min + range.max) / 3]) {
      const back = valueAt(range, placeOf(range, value));
      assert.ok(Math.abs(back - value) <= 0.006 * Math.max(1, Math.abs(value)), `${value} became ${back}`);
    }
  }
  assert.equal(numberText(Math.fround(0.1)), "0.1");
  assert.equal(numberText(1e6), "1000000");
});

test("every number of a cloth has a unit or none, a range and a help text", () => {
  for (const { option, unit, min, max, initial, help } of kClothParameters) {
    assert.ok(help.length > 10 && typeof unit === "string", option);
    assert.ok(min < max && (initial === 0 || (initial >= min && initial <= max)), option);
  }
  assert.equal(new Set(kClothParameters.map(({ offset }) => offset)).size, kClothParameters.length);
});

test("wind keeps speed, heading and rise", () => {
  assert.deepEqual(windOf([0, 0, 0]), { speed: 0, heading: 0, rise: 0 });
  for (const wind of [{ speed: 3, heading: 0, rise: 0 }, { speed: 2, heading: 90, rise: 30 }, { speed: 1, heading: -135, rise: -80 }]) {
    const back = windOf(vectorOf(wind));
    for (const key of ["speed", "heading", "rise"] as const) assert.ok(Math.abs(back[key] - wind[key]) < 1e-9, JSON.stringify(back));
  }
  const [x, y, z] = vectorOf({ speed: 2, heading: 90, rise: 0 });
  assert.ok(Math.abs(x - 2) < 1e-9 && Math.abs(y) < 1e-9 && Math.abs(z) < 1e-9, "90 degrees is to the right");
  assert.ok(vectorOf({ speed: 1, heading: 0, rise: 0 })[2] === -1, "0 degrees is away from the viewer");
});

const sampleOf = (value: number) => Object.fromEntries(kChannels.map((name, index) => [name, value + index])) as Sample;

test("the history keeps the newest samples", () => {
  const history = new HudHistory(3);
  assert.equal(history.length, 0);
  assert.equal(history.at("roundTrip"), 0);
  for (const value of [1, 2, 3, 4]) history.add(sampleOf(value));
  assert.equal(history.length, 3);
  assert.equal(history.at("displayRate"), 4);
  assert.equal(history.at("displayRate", 2), 2);
  assert.equal(history.at("displayRate", 3), 0);
  assert.equal(history.largest("displayRate"), 4);
  assert.equal(history.sum("displayRate"), 9);
  assert.equal(history.latency(), kStages.reduce((sum, stage) => sum + 4 + kChannels.indexOf(stage), 0));
});

type Call = [name: string, ...values: unknown[]];

// Records the calls of a context instead of drawing.
function recorder(): { context: CanvasRenderingContext2D; calls: Call[] } {
  const calls: Call[] = [];
  const context = new Proxy({} as CanvasRenderingContext2D, {
    get: (_, name) =>
      name === "measureText"
        ? (text: string) => ({ width: 6 * text.length })
        : (...values: unknown[]) => void calls.push([String(name), ...values]),
    set: () => true,
  });
  return { context, calls };
}

test("the drawing needs only a context, and stays inside its size", () => {
  const theme = { text: "#fff", quiet: "#aaa", line: "#333", accent: "#fa0", bad: "#f00", stages: ["#1", "#2", "#3", "#4", "#5"], font: "sans-serif" };
  for (const samples of [0, 1, 300]) {
    const history = new HudHistory();
    for (let i = 0; i < samples; ++i) history.add(sampleOf(i));
    const { context, calls } = recorder();
    drawHud(context, history, theme);
    assert.ok(calls.length > 20);
    for (const [name, ...place] of calls.filter(([name]) => name === "lineTo" || name === "moveTo")) {
      const [x, y] = place as [number, number];
      assert.ok(x >= -1e-3 && x <= kHudWidth + 1e-3 && y >= -1e-3 && y <= kHudHeight + 1e-3, `${name} ${x} ${y}`);
    }
    const texts = calls.filter(([name]) => name === "fillText").map(([, text]) => text);
    for (const wanted of ["display", "stream", "frame age", "round trip", "network", "precision", "pose to picture"])
      assert.ok(texts.includes(wanted), wanted);
  }
  assert.equal(hudText(new HudHistory()), "No figures yet.");
});

test("figures say how frames travel, and why not in datagrams", () => {
  const history = new HudHistory();
  const quiet = Object.fromEntries(kChannels.map((name) => [name, 0])) as Sample;
  history.link = { transport: "websocket", reason: "The server opens no datagrams." };
  history.add(quiet);
  assert.match(hudText(history), / Frames by WebSocket: The server opens no datagrams\.$/);
  history.link = { transport: "datagrams", reason: "" };
  history.add({ ...quiet, packets: 150, lostPackets: 4, parityPackets: 30, repairedFrames: 2, requests: 1 });
  history.add({ ...quiet, packets: 150, lostPackets: 8, parityPackets: 60, repairedFrames: 3, requests: 2 });
  assert.match(hudText(history), / Frames by datagrams: loss 3\.8 %, repaired 5 \/min, requests 3 \/min, parity 30\.0 %\.$/);
  for (const [transport, reason, wanted] of [["websocket", "It is blocked.", ["WebSocket", "It is blocked."]], ["datagrams", "", ["datagrams", "loss", "3.8", "30.0"]]] as const) {
    history.link = { transport, reason };
    const { context, calls } = recorder();
    drawHud(context, history, { text: "", quiet: "", line: "", accent: "", bad: "", stages: ["", "", "", "", ""], font: "" });
    const texts = calls.filter(([name]) => name === "fillText");
    for (const text of wanted) assert.ok(texts.some(([, one]) => one === text), text);
    for (const [, text, x, y] of texts) assert.ok((x as number) < kHudWidth && (y as number) < kHudHeight, String(text));
  }
});

test("counts of the link start again with each association", () => {
  const counter = new LinkCounter();
  const counts = { inUse: true, packets: 10, lostPackets: 1, parityPackets: 2, frames: 5, repairedFrames: 1, lostFrames: 0, requests: 3, heldFrames: 0 };
  const grown = (packets: number, requests: number) => [packets, requests].join();
  const take = (now?: Partial<typeof counts>) => {
    const { packets, requests } = counter.take(now && { ...counts, ...now });
    return grown(packets, requests);
  };
  assert.equal(take(), grown(0, 0));
  assert.equal(take({}), grown(10, 3));
  assert.equal(take({ packets: 15, requests: 4 }), grown(5, 1));
  assert.equal(take({ packets: 2, requests: 0 }), grown(2, 0), "a new association");
  assert.equal(take(), grown(0, 0));
  assert.equal(take({ packets: 7, requests: 1 }), grown(7, 1), "after none");
});
