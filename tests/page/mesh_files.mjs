// SPDX-License-Identifier: MIT
// Makes mesh files, and drops them on a page.

import { createRequire } from "node:module";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));

// A sheet of size x size vertices, 1 m wide, that hangs in the XY plane, or lies flat in the XZ plane.
function sheet(size, flat) {
  const positions = new Float32Array(3 * size * size);
  for (let i = 0; i < size * size; ++i) {
    positions[3 * i] = (i % size) / (size - 1) - 0.5;
    const down = Math.floor(i / size) / (size - 1);
    positions[3 * i + (flat ? 2 : 1)] = flat ? down - 0.5 : 1 - down;
  }
  const indices = [];
  for (let row = 0; row + 1 < size; ++row) {
    for (let column = 0; column + 1 < size; ++column) {
      const a = row * size + column;
      indices.push(a, a + size, a + 1, a + 1, a + size, a + size + 1);
    }
  }
  return { positions, triangles: Uint32Array.from(indices) };
}

// A sheet as the bytes of a GLB file.
export function sheetGlb(size, { flat = false } = {}) {
  const { positions, triangles } = sheet(size, flat);
  const json = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    buffers: [{ byteLength: positions.byteLength + triangles.byteLength }],
    bufferViews: [
      { buffer: 0, byteLength: positions.byteLength },
      { buffer: 0, byteOffset: positions.byteLength, byteLength: triangles.byteLength },
    ],
    accessors: [
      { bufferView: 0, componentType: 5126, count: size * size, type: "VEC3" },
      { bufferView: 1, componentType: 5125, count: triangles.length, type: "SCALAR" },
    ],
  };
  return glb(json, Buffer.concat([Buffer.from(positions.buffer), Buffer.from(triangles.buffer)]));
}

// A figure behind the hanging sheet, as the bytes of a GLB file: a box from (-0.4, 0, -0.3) to (0.4, 1, -0.1) with the joints
// "base" and "tip". The animation moves the base by 0.4 m to the right and back, in two seconds.
export function figureGlb() {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1 ? 0.4 : -0.4, i & 2 ? 1 : 0, i & 4 ? -0.1 : -0.3]);
  const arrays = [
    Float32Array.from(corners.flat()),
    Uint16Array.from([0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5]),
    Uint16Array.from(corners.flatMap(([, y]) => [y > 0 ? 1 : 0, 0, 0, 0])),
    Float32Array.from(corners.flatMap(() => [1, 0, 0, 0])),
    // Inverses of the places of the joints, column by column.
    Float32Array.from([0, 1].flatMap((height) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -height, 0.2, 1])),
    Float32Array.from([0, 1, 2]),
    Float32Array.from([0, 0, -0.2, 0.4, 0, -0.2, 0, 0, -0.2]),
  ];
  const kinds = [
    [5126, "VEC3"],
    [5123, "SCALAR"],
    [5123, "VEC4"],
    [5126, "VEC4"],
    [5126, "MAT4"],
    [5126, "SCALAR"],
    [5126, "VEC3"],
  ];
  const components = { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 };
  const bytes = arrays.map((array) => Buffer.from(array.buffer));
  const offset = (index) => bytes.slice(0, index).reduce((sum, part) => sum + part.length, 0);
  const json = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0, 2] }],
    nodes: [
      { name: "base", translation: [0, 0, -0.2], children: [1] },
      { name: "tip", translation: [0, 1, 0] },
      { mesh: 0, skin: 0 },
    ],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, JOINTS_0: 2, WEIGHTS_0: 3 }, indices: 1 }] }],
    skins: [{ joints: [0, 1], inverseBindMatrices: 4 }],
    animations: [{ name: "sway", samplers: [{ input: 5, output: 6 }], channels: [{ sampler: 0, target: { node: 0, path: "translation" } }] }],
    buffers: [{ byteLength: offset(bytes.length) }],
    bufferViews: bytes.map((part, i) => ({ buffer: 0, byteOffset: offset(i), byteLength: part.length })),
    accessors: arrays.map((array, i) => {
      const [componentType, type] = kinds[i];
      const extent = i === 0 ? { min: [-0.4, 0, -0.3], max: [0.4, 1, -0.1] } : i === 5 ? { min: [0], max: [2] } : {};
      return { bufferView: i, componentType, count: array.length / components[type], type, ...extent };
    }),
  };
  return glb(json, Buffer.concat(bytes));
}

// The hanging sheet as the bytes of a GLB file that is compressed with Draco.
export async function dracoGlb(size) {
  const { positions, triangles } = sheet(size, false);
  const draco = await require("draco3d").createEncoderModule({});
  const [builder, mesh, encoder, out] = [new draco.MeshBuilder(), new draco.Mesh(), new draco.Encoder(), new draco.DracoInt8Array()];
  builder.AddFacesToMesh(mesh, triangles.length / 3, triangles);
  const attribute = builder.AddFloatAttributeToMesh(mesh, draco.POSITION, size * size, 3, positions);
  const length = encoder.EncodeMeshToDracoBuffer(mesh, out);
  const bytes = Buffer.from(Int8Array.from({ length }, (_, i) => out.GetValue(i)).buffer);
  const extension = "KHR_draco_mesh_compression";
  const json = {
    asset: { version: "2.0" },
    extensionsUsed: [extension],
    extensionsRequired: [extension],
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [
      { primitives: [{ attributes: { POSITION: 0 }, indices: 1, extensions: { [extension]: { bufferView: 0, attributes: { POSITION: attribute } } } }] },
    ],
    buffers: [{ byteLength: bytes.length }],
    bufferViews: [{ buffer: 0, byteLength: bytes.length }],
    accessors: [
      { componentType: 5126, count: size * size, type: "VEC3" },
      { componentType: 5125, count: triangles.length, type: "SCALAR" },
    ],
  };
  return glb(json, bytes);
}

function glb(json, binary) {
  const padded = (bytes, filler) => Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4, filler)]);
  const [text, data] = [padded(Buffer.from(JSON.stringify(json)), " "), padded(binary, 0)];
  const word = (...values) => Buffer.from(Uint32Array.from(values).buffer);
  const total = 12 + 8 + text.length + 8 + data.length;
  return Buffer.concat([word(0x46546c67, 2, total), word(text.length, 0x4e4f534a), text, word(data.length, 0x004e4942), data]);
}

// An OBJ file of one large triangle and a row of `count` small ones. Its longest side is 2.
export function fineObj(count) {
  const lines = ["v 0 0 0", "v 2 0 0", "v 0 1 0", "f 1 2 3"];
  const edge = 0.004;
  for (let i = 0; i < count + 2; ++i) lines.push(`v ${(i * edge) / 2} ${i % 2 === 0 ? 1.5 : 1.5 + edge} 0`);
  for (let i = 0; i < count; ++i) lines.push(i % 2 === 0 ? `f ${i + 4} ${i + 6} ${i + 5}` : `f ${i + 4} ${i + 5} ${i + 6}`);
  return Buffer.from(lines.join("\n"));
}

// Drops a file on the picture.
export async function dropFile(page, name, bytes) {
  const data = await page.evaluateHandle(
    ([file, base64]) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(atob(base64), (character) => character.charCodeAt(0))], file));
      return transfer;
    },
    [name, Buffer.from(bytes).toString("base64")],
  );
  await page.dispatchEvent("#canvas", "drop", { dataTransfer: data });
}
