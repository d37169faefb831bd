// SPDX-License-Identifier: MIT
// Logic of the panel without a browser: pins and places of meshes, numbers, wind, figures, bytes of a scene.

import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./modules.mjs";

const panel = "page/src/panel";
const { boundsOf, likelySize, nameFor, pinsOf, placeOf: meshPlace } = await load(`${panel}/pins.ts`);
const { numberText, placeOf, powerOf, valueAt } = await load(`${panel}/number_row.ts`);
const { vectorOf, windOf } = await load(`${panel}/wind.ts`);
const { HudHistory, kChannels } = await load(`${panel}/hud_history.ts`);
const { drawHud, hudText, kHudHeight, kHudWidth } = await load(`${panel}/hud_drawing.ts`);
const { packed, sceneBytes } = await load("client/src/scene_bytes.ts");
const { kClothParameters, kSettings } = await load("client/src/tables.ts");

// 3 x 3 vertices, 2 m wide and 1 m high, in the plane of two axes.
function sheet(right, up) {
  const positions = new Float32Array(27);
  for (let i = 0; i < 9; ++i) {
    positions[3 * i + right] = (i % 3) - 1;
    positions[3 * i + up] = 1 - Math.floor(i / 3) / 2;
  }
  return positions;
}

test("pins are on the upper edge, at its ends, at the corners, or in a part", () => {
  const hanging = sheet(0, 1);
  assert.deepEqual(pinsOf(hanging, "top", 0), [0, 1, 2]);
  assert.deepEqual(pinsOf(hanging, "topCorners", 0), [0, 2]);
  assert.deepEqual(pinsOf(hanging, "corners", 0), [0, 2, 6, 8]);
  assert.deepEqual(pinsOf(hanging, "part", 0.5), [0, 1, 2, 3, 4, 5]);
  assert.deepEqual(pinsOf(hanging, "part", 0), [0, 1, 2]);
  assert.deepEqual(pinsOf(hanging, "none", 0.5), []);
  assert.deepEqual(pinsOf(new Float32Array(), "top", 0), []);
  // A sheet that lies flat has four corners, and is at one height.
  assert.deepEqual(pinsOf(sheet(0, 2), "corners", 0), [0, 2, 6, 8]);
  assert.equal(pinsOf(sheet(0, 2), "top", 0).length, 9);
  // A sheet along z has its ends there.
  assert.deepEqual(pinsOf(sheet(2, 1), "topCorners", 0), [0, 2]);
});

test("all vertices in a pinned place are pinned", () => {
  const positions = new Float32Array([...sheet(0, 1), -1, 1, 0]);
  assert.deepEqual(pinsOf(positions, "topCorners", 0), [0, 2, 9]);
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
    for (const key of ["speed", "heading", "rise"]) assert.ok(Math.abs(back[key] - wind[key]) < 1e-9, JSON.stringify(back));
  }
  const [x, y, z] = vectorOf({ speed: 2, heading: 90, rise: 0 });
  assert.ok(Math.abs(x - 2) < 1e-9 && Math.abs(y) < 1e-9 && Math.abs(z) < 1e-9, "90 degrees is to the right");
  assert.ok(vectorOf({ speed: 1, heading: 0, rise: 0 })[2] === -1, "0 degrees is away from the viewer");
});

const sampleOf = (value) => Object.fromEntries(kChannels.map((name, index) => [name, value + index]));

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
  // Stages are the last five channels.
  assert.equal(history.latency(), 4 * 5 + 8 + 9 + 10 + 11 + 12);
});

// Records the calls of a context instead of drawing.
function recorder() {
  const calls = [];
  const context = new Proxy(
    { measureText: (text) => ({ width: 6 * text.length }) },
    {
      get: (target, name) => target[name] ?? ((...values) => void calls.push([name, ...values])),
      set: () => true,
    },
  );
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
    for (const [name, x, y] of calls.filter(([name]) => name === "lineTo" || name === "moveTo")) {
      assert.ok(x >= -1e-3 && x <= kHudWidth + 1e-3 && y >= -1e-3 && y <= kHudHeight + 1e-3, `${name} ${x} ${y}`);
    }
    const texts = calls.filter(([name]) => name === "fillText").map(([, text]) => text);
    for (const wanted of ["display", "stream", "frame age", "round trip", "network", "precision", "pose to picture"])
      assert.ok(texts.includes(wanted), wanted);
  }
  assert.equal(hudText(new HudHistory()), "No figures yet.");
});

// Fields of a protobuf message as [number, value].
function fieldsOf(bytes) {
  const fields = [];
  let at = 0;
  const varint = () => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const byte = bytes[at++];
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const tag = varint();
    if ((tag & 7) === 0) {
      fields.push([tag >> 3, varint()]);
      continue;
    }
    const size = (tag & 7) === 2 ? varint() : 4;
    fields.push([tag >> 3, bytes.subarray(at, at + size)]);
    at += size;
  }
  return fields;
}

test("a scene has its cloth, mesh, pins and floor", () => {
  const scene = sceneBytes({
    name: "sheet",
    description: "From a file",
    positions: sheet(0, 1),
    triangles: Uint32Array.from([0, 3, 1]),
    scale: 0.5,
    position: [1, 2, 3],
    material: "cotton",
    massPerArea: 0.25,
    pinned: [0, 300],
    repair: true,
    selfCollision: true,
    floor: true,
  });
  const fields = new Map(fieldsOf(scene));
  assert.equal(Buffer.from(fields.get(1)).toString(), "sheet");
  const cloth = new Map(fieldsOf(fields.get(8)));
  assert.equal(Buffer.from(cloth.get(40)).toString(), "cotton");
  assert.deepEqual([...cloth.get(15)], [0, 0xac, 0x02]);
  assert.equal(cloth.get(21).length, 0);
  const mesh = new Map(fieldsOf(cloth.get(14)));
  assert.equal(mesh.get(2).length, 4 * 27);
  assert.deepEqual([...mesh.get(3)], [0, 3, 1]);
  assert.equal(mesh.get(70), 1);
  assert.equal(Buffer.from(mesh.get(9)).readFloatLE(0), 0.5);
  assert.equal(new Map(fieldsOf(fields.get(9))).get(4).length, 0);
  assert.deepEqual([...packed([0, 127, 128, 2 ** 31])], [0, 127, 128, 1, 128, 128, 128, 128, 8]);
});
