// SPDX-License-Identifier: MIT
// The definition of a scene as protobuf bytes.

import { assert, test } from "vitest";
import { packed, sceneBytes } from "../../../clients/web/client/src/scene_bytes";

// Fields of a protobuf message: numbers, and bytes of strings, messages and floats.
function fieldsOf(bytes: Uint8Array): { number(field: number): number; bytes(field: number): Uint8Array; text(field: number): string } {
  const fields = new Map<number, number | Uint8Array>();
  let at = 0;
  const varint = () => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const byte = bytes[at++]!;
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const tag = varint();
    if ((tag & 7) === 0) {
      fields.set(tag >> 3, varint());
      continue;
    }
    const size = (tag & 7) === 2 ? varint() : 4;
    fields.set(tag >> 3, bytes.subarray(at, at + size));
    at += size;
  }
  const content = (field: number) => fields.get(field) as Uint8Array;
  return {
    number: (field) => fields.get(field) as number,
    bytes: content,
    text: (field) => new TextDecoder().decode(content(field)),
  };
}

test("a scene has its cloth, mesh, pins and floor", () => {
  const scene = sceneBytes({
    name: "sheet",
    description: "From a file",
    positions: new Float32Array(27),
    triangles: Uint32Array.from([0, 3, 1]),
    scale: 0.5,
    position: [1, 2, 3],
    material: "cotton",
    massPerArea: 0.25,
    pinned: [0, 300],
    repair: true,
    fit: true,
    selfCollision: true,
    floor: true,
  });
  const fields = fieldsOf(scene);
  assert.equal(fields.text(1), "sheet");
  const cloth = fieldsOf(fields.bytes(8));
  assert.equal(cloth.text(40), "cotton");
  assert.deepEqual([...cloth.bytes(15)], [0, 0xac, 0x02]);
  assert.equal(cloth.bytes(21).length, 0);
  const mesh = fieldsOf(cloth.bytes(14));
  assert.equal(mesh.bytes(2).length, 4 * 27);
  assert.deepEqual([...mesh.bytes(3)], [0, 3, 1]);
  assert.equal(mesh.number(70), 1);
  assert.equal(mesh.number(71), 1);
  assert.equal(new DataView(mesh.bytes(9).slice().buffer).getFloat32(0, true), 0.5);
  assert.equal(fieldsOf(fields.bytes(9)).bytes(4).length, 0);
  assert.deepEqual([...packed([0, 127, 128, 2 ** 31])], [0, 127, 128, 1, 128, 128, 128, 128, 8]);
});

test("a cloth on a figure has the figure as a collider with joints, in metres, and its limits", () => {
  const pose = (x: number) => ({ position: [x, 0, 0], orientation: [0, 0, 0, 1] });
  const scene = sceneBytes({
    name: "skirt",
    description: "From a file",
    positions: new Float32Array(9),
    triangles: Uint32Array.from([0, 1, 2]),
    scale: 0.5,
    position: [0, 0, 0],
    material: "",
    pinned: [],
    repair: false,
    fit: false,
    selfCollision: false,
    floor: false,
    figure: {
      positions: new Float32Array(12),
      triangles: Uint32Array.from([0, 1, 2, 0, 2, 3]),
      joints: [
        { name: "hips", parent: undefined, rest: pose(4) },
        { name: "leg", parent: 0, rest: pose(6) },
      ],
      vertexJoints: Uint32Array.from([1, 0, 0, 0]),
      vertexWeights: Float32Array.from([1, 0, 0, 0]),
      keys: [{ time: 0, joints: [pose(8), pose(2)] }],
    },
    limits: { maxDistances: Float32Array.from([0, -1, 0.25]) },
  });
  const fields = fieldsOf(scene);
  const floatAt = (bytes: Uint8Array, index = 0) => new DataView(bytes.slice().buffer).getFloat32(4 * index, true);
  const skin = fieldsOf(fieldsOf(fields.bytes(8)).bytes(43));
  assert.equal(skin.text(1), "figure");
  assert.deepEqual([0, 1, 2].map((i) => floatAt(skin.bytes(5), i)), [0, -1, 0.25]);
  assert.equal(skin.bytes(6), undefined, "there are no backstops");
  const collider = fieldsOf(fields.bytes(9));
  assert.equal(collider.text(1), "figure");
  const mesh = fieldsOf(collider.bytes(30));
  assert.equal(floatAt(mesh.bytes(4)), 0.5);
  assert.deepEqual([...mesh.bytes(3)], [0, 1, 2, 0, 2, 3]);
  const joints = fieldsOf(mesh.bytes(5));
  assert.deepEqual([...joints.bytes(2)], [1, 0, 0, 0]);
  // The last of the joints, and of the poses of the key. Lengths are scaled.
  const leg = fieldsOf(joints.bytes(1));
  assert.deepEqual([leg.text(1), leg.number(2)], ["leg", 0]);
  assert.equal(floatAt(fieldsOf(fieldsOf(leg.bytes(3)).bytes(1)).bytes(1)), 3);
  assert.equal(floatAt(fieldsOf(fieldsOf(leg.bytes(3)).bytes(2)).bytes(4)), 1);
  const key = fieldsOf(fieldsOf(joints.bytes(4)).bytes(1));
  assert.equal(floatAt(fieldsOf(fieldsOf(key.bytes(2)).bytes(1)).bytes(1)), 1);
});
