// SPDX-License-Identifier: MIT
// Makes mesh files, and drops them on a page.

// A sheet of size x size vertices, 1 m wide, that hangs in the XY plane, as the bytes of a GLB file.
export function sheetGlb(size) {
  const positions = new Float32Array(3 * size * size);
  for (let i = 0; i < size * size; ++i) {
    positions[3 * i] = (i % size) / (size - 1) - 0.5;
    positions[3 * i + 1] = 1 - Math.floor(i / size) / (size - 1);
  }
  const indices = [];
  for (let row = 0; row + 1 < size; ++row) {
    for (let column = 0; column + 1 < size; ++column) {
      const a = row * size + column;
      indices.push(a, a + size, a + 1, a + 1, a + size, a + size + 1);
    }
  }
  const triangles = Uint32Array.from(indices);
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
      { bufferView: 0, componentType: 5126, count: size * size, type: "VEC3", min: [-0.5, 0, 0], max: [0.5, 1, 0] },
      { bufferView: 1, componentType: 5125, count: triangles.length, type: "SCALAR" },
    ],
  };
  const text = Buffer.from(JSON.stringify(json));
  const padded = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, " ")]);
  const binary = Buffer.concat([Buffer.from(positions.buffer), Buffer.from(triangles.buffer)]);
  const word = (...values) => Buffer.from(Uint32Array.from(values).buffer);
  const total = 12 + 8 + padded.length + 8 + binary.length;
  return Buffer.concat([word(0x46546c67, 2, total), word(padded.length, 0x4e4f534a), padded, word(binary.length, 0x004e4942), binary]);
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
