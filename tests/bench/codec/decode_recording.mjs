// SPDX-License-Identifier: MIT
// Time of a frame in the page's client core: decodes a file of `clothstream encode` in WebAssembly.
// Usage: node decode_recording.mjs MODULE RECORDING [--json]; the module is build/release/web/clothstream_core.wasm.
import { Core, readRecording } from "../../core/recording.mjs";

const [modulePath, recording, json] = process.argv.slice(2);
if (recording === undefined) {
  console.error("usage: node decode_recording.mjs MODULE RECORDING [--json]");
  process.exit(2);
}
// The engine optimises code that runs often, so the last pass counts.
const kPasses = 3;

const messages = readRecording(recording);
const core = new Core(modulePath);
const now = () => Number(process.hrtime.bigint()) / 1e6;
let times;
let vertices;
for (let pass = 0; pass < kPasses; ++pass) {
  const client = core.client();
  messages.before.forEach((message) => core.receive(client, message));
  times = messages.frames.map((message) => {
    const start = now();
    core.receive(client, message);
    const decoded = now();
    core.exports.cs_normals(client);
    return { decode: decoded - start, normals: now() - decoded };
  });
  vertices = core.exports.cs_vertex_count(client);
  if (core.goodFrames(client) !== messages.frames.length) throw new Error("a frame decodes to a different state");
  core.exports.cs_destroy(client);
}

function quantile(values, part) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(Math.ceil(part * sorted.length), 1) - 1];
}
const decode = times.map((time) => time.decode);
const normals = times.map((time) => time.normals);
const row = {
  suite: "codec_wasm",
  vertices,
  frames: decode.length,
  decodeMs: quantile(decode, 0.5),
  decodeMsMin: quantile(decode, 0),
  decodeMsP99: quantile(decode, 0.99),
  normalsMs: quantile(normals, 0.5),
  engine: `node ${process.version}, V8 ${process.versions.v8}`,
};
if (json === "--json") console.log(JSON.stringify([row], null, 2));
else
  console.log(
    `${vertices} vertices, ${row.frames} frames: ${row.decodeMs.toFixed(3)} ms to decode one (median), ` +
      `${row.decodeMsMin.toFixed(3)} at least, ${row.decodeMsP99.toFixed(3)} p99; ${row.normalsMs.toFixed(3)} ms for its normals; ${row.engine}`,
  );
