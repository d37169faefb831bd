// SPDX-License-Identifier: MIT
// The WebAssembly core decodes a file of `clothstream encode` bit for bit like `clothstream decode`.
// Usage: node recording.test.mjs MODULE CLOTHSTREAM
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { Core, readRecording } from "./recording.mjs";

const [modulePath, clothstream] = process.argv.slice(2);
// The rest positions need more than one chunk.
const [columns, rows, frames] = [190, 121, 6];
const directory = mkdtempSync(join(tmpdir(), "clothstream-"));
const [motion, recording, decoded] = ["motion", "recording", "decoded"].map((name) => join(directory, name));

function writeMotion() {
  const file = Buffer.alloc(16 + frames * 24 * columns * rows);
  [columns, rows, frames, 0].forEach((value, index) => file.writeInt32LE(value, 4 * index));
  let at = 16;
  for (let frame = 0; frame < frames; ++frame) {
    for (let vertex = 0; vertex < columns * rows; ++vertex) {
      const [x, y] = [0.01 * (vertex % columns), -0.01 * Math.floor(vertex / columns)];
      for (const value of [x, y, 0.05 * Math.sin(9 * x + 4 * y + 0.3 * frame)]) at = file.writeFloatLE(value, at);
    }
    for (let vertex = 0; vertex < columns * rows; ++vertex) for (const value of [0, 0, 1]) at = file.writeFloatLE(value, at);
  }
  writeFileSync(motion, file);
}

try {
  writeMotion();
  execFileSync(clothstream, ["encode", motion, recording, "--key-every", "4"]);
  execFileSync(clothstream, ["decode", recording, decoded]);
  const native = readFileSync(decoded);
  const core = new Core(modulePath);
  const client = core.client();
  const messages = readRecording(recording);
  messages.before.forEach((message) => core.receive(client, message));
  assert.equal(messages.frames.length, frames);
  messages.frames.forEach((message, frame) => {
    assert.equal(core.receive(client, message), 1, `frame ${frame} is decoded`);
    const planes = ["cs_positions", "cs_normals"].map((name) => core.floats(core.exports[name](client), client));
    planes.forEach((plane, index) => {
      const start = 16 + (2 * frame + index) * plane.byteLength;
      assert(Buffer.from(plane.buffer, plane.byteOffset, plane.byteLength).equals(native.subarray(start, start + plane.byteLength)), `frame ${frame}`);
    });
  });
  assert.equal(core.goodFrames(client), frames);
  console.log(`${frames} frames of ${columns}x${rows} vertices, the same as natively`);
} finally {
  rmSync(directory, { recursive: true });
}
