// SPDX-License-Identifier: MIT
// @clothstream/client reads recordings in WebAssembly: every frame has the hash that the recording states, a seek gives
// the frame that playing gives, and damaged files give errors. Usage: client_recording.test.mjs MODULE RECORDING...
// A recording may be compressed with gzip. The first one is also cut and damaged; write_sample wrote it, and the same one
// with packets that cannot be decoded.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { mkdtempSync, rmSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { gunzipSync } from "node:zlib";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));
const { buildSync } = require("esbuild");
const [modulePath, ...paths] = process.argv.slice(2);
const wasm = new WebAssembly.Module(readFileSync(modulePath));
const imports = WebAssembly.Module.imports(wasm).map(({ module, name }) => `${module}.${name}`);
assert.deepEqual(imports.sort(), ["clothstream.decompress", "clothstream.read"], "the module imports only these");

const folder = mkdtempSync(join(tmpdir(), "clothstream-recording-"));
const entry = new URL("../../clients/web/client/src/recording.ts", import.meta.url).pathname;
buildSync({ entryPoints: [entry], bundle: true, format: "esm", outfile: join(folder, "recording.mjs"), logLevel: "warning" });
const { openRecording, Recorded } = await import(pathToFileURL(join(folder, "recording.mjs")).href);
rmSync(folder, { recursive: true });

function bytesOf(path) {
  const file = readFileSync(path);
  return new Uint8Array(file[0] === 0x1f && file[1] === 0x8b ? gunzipSync(file) : file);
}

let read = 0;
for (const path of paths) {
  const bytes = bytesOf(path);
  const recording = await openRecording(bytes, { wasm });
  assert.equal(recording.info.complete, true);
  assert.equal(recording.info.bytes, bytes.length);
  assert.notEqual(recording.metadata("scene"), "");
  assert.equal(recording.metadata("no such entry"), "");
  const frames = [];
  let ticks = 0;
  for (let message; (message = recording.next(Recorded.all)); ) {
    assert(recording.bytes().length > 0);
    if (message.kind === Recorded.tick) {
      ++ticks;
      const tick = recording.tick();
      assert.equal(tick.tick, message.tick);
      assert.equal(tick.stateHash, message.stateHash);
    }
    if (message.kind === Recorded.checkpoint) assert.equal(recording.state().nodes.length, 6 * recording.frames.vertexCount);
    if (message.kind !== Recorded.frame) continue;
    assert.equal(recording.hash, message.reconstructionHash, `${path}: frame ${frames.length}`);
    frames.push({ ...message, positions: recording.frames.positions().slice() });
  }
  assert.equal(frames.length, recording.info.frames);
  assert.equal(ticks, recording.info.ticks);
  assert(frames.length > 5);
  for (let round = 0; round < 40; ++round) {
    const { tick, seconds, positions } = frames[(round * 7919) % frames.length];
    const found = round % 2 === 0 ? recording.seek(seconds) : recording.seekTick(tick);
    assert.equal(found.tick, tick);
    assert.equal(recording.hash, found.reconstructionHash);
    assert.deepEqual(recording.frames.positions(), positions);
  }
  assert.equal(recording.seekTick(0n), undefined, "there is no frame before the first");
  assert.throws(() => recording.seek(NaN), /not a number/);
  recording.close();
  read += frames.length;
}

const garbage = bytesOf(paths[0].replace(".mcap", ".garbage.mcap"));
const undecodable = await openRecording(garbage, { wasm });
assert.throws(() => undecodable.next(), /the frame of an unknown tick at 0.000 s cannot be decoded/);
assert.equal(undecodable.next(), undefined);
const { frames: all, undecodable: lost, different, firstTick } = undecodable.faults;
assert.deepEqual([all, lost, different, firstTick], [undecodable.info.frames, undecodable.info.frames, 0, 0n]);
undecodable.close();
await assert.rejects(openRecording(garbage, { wasm, maxVertices: 41 }), /42 vertices; this client accepts at most 41/);

const whole = bytesOf(paths[0]);
await assert.rejects(openRecording(new Uint8Array([1, 2, 3]), { wasm }), /not an MCAP file/);
const failing = { size: whole.length, read: () => assert.fail("the disk is gone") };
await assert.rejects(openRecording(failing, { wasm }), /cannot be read|not an MCAP file|missing/);

// Reads as far as possible. Returns the number of frames, or undefined if the bytes cannot be opened.
async function framesOf(bytes) {
  let recording;
  try {
    recording = await openRecording(bytes, { wasm });
  } catch (error) {
    assert(error instanceof Error && !(error instanceof WebAssembly.RuntimeError), `${error}`);
    return undefined;
  }
  let frames = 0;
  for (let errors = 0; errors < 3; ) {
    try {
      if (!recording.next()) break;
      ++frames;
    } catch (error) {
      assert(!(error instanceof WebAssembly.RuntimeError), `${error}`);
      ++errors;
    }
  }
  recording.close();
  return frames;
}

let before = 0;
for (let length = 0; length < whole.length; length += Math.ceil(whole.length / 150)) {
  const frames = (await framesOf(whole.subarray(0, length))) ?? 0;
  assert(frames >= before, "a longer file has at least as many frames");
  before = frames;
}
assert(before > 5);
let seed = 1;
for (let round = 0; round < 150; ++round) {
  const damaged = whole.slice();
  for (let i = 0; i < 4; ++i) {
    seed = (seed * 48271) % 2147483647;
    damaged[seed % damaged.length] ^= 1 << seed % 8;
  }
  await framesOf(damaged);
}
console.log(`${paths.length} recordings with ${read} frames have the recorded hashes`);
