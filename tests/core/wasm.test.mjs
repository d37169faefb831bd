// SPDX-License-Identifier: MIT
// The WebAssembly client core gives the same observations as the native one for every recorded session, and the hashes
// of tests/golden for the golden packets. Usage: node wasm.test.mjs MODULE SESSIONS GOLDEN
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

const [modulePath, sessionsPath, goldenPath] = process.argv.slice(2);
const module = new WebAssembly.Module(readFileSync(modulePath));
const { stepUs, playOutDelayMs, sessions } = JSON.parse(readFileSync(sessionsPath));
const golden = JSON.parse(readFileSync(goldenPath));

assert.deepEqual(WebAssembly.Module.imports(module), [], "the core imports nothing");
const { core: described } = JSON.parse(readFileSync(new URL("../../clients/interface/interface.json", import.meta.url), "utf8"));
const declared = Object.keys(described.functions).filter((name) => !described.native.includes(name));
const exported = new Set(WebAssembly.Module.exports(module).map(({ name }) => name));
for (const name of [...declared, "memory", "_initialize", "malloc", "free"]) assert(exported.has(name), `${name} is exported`);

const core = new WebAssembly.Instance(module).exports;
core._initialize();

// Offsets of members of a struct of core.h.
function offsetsOf(struct) {
  return Object.fromEntries(described.structs[struct].fields.map(({ name, offset }) => [name, offset.wasm32]));
}
const kOptions = offsetsOf("cs_client_options");
const kPlayOut = offsetsOf("cs_play_out_options");
const kCollider = offsetsOf("cs_collider");
const kStatistics = offsetsOf("cs_statistics");

const bytes = (pointer, count) => new Uint8Array(core.memory.buffer, pointer, count);
const word = (pointer) => new DataView(core.memory.buffer).getUint32(pointer, true);

function copyIn(data) {
  const pointer = core.malloc(Math.max(data.length, 1));
  bytes(pointer, data.length).set(data);
  return pointer;
}

function text(pointer) {
  let end = pointer;
  const memory = new Uint8Array(core.memory.buffer);
  while (memory[end] !== 0) ++end;
  return memory.slice(pointer, end);
}

const kBasis = 0xcbf29ce484222325n;
function fnv1a(data, hash = kBasis) {
  for (const byte of data) hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
  return hash;
}
const hex64 = (value) => BigInt.asUintN(64, value).toString(16).padStart(16, "0");

const scratch = core.malloc(256);
// Prepares the scratch memory for a struct of this version.
const setVersion = (version) => new DataView(core.memory.buffer, scratch).setUint32(0, version, true);

function outgoingHash(client) {
  let hash = kBasis;
  for (;;) {
    const message = core.cs_next_outgoing(client, scratch);
    if (message === 0) return hash;
    hash = fnv1a(bytes(message, word(scratch)), hash);
  }
}

function floatsHash(pointer, vertices) {
  return vertices === 0 ? 0n : fnv1a(bytes(pointer, 12 * vertices));
}

// Hashes positions and orientations.
function playedCollidersHash(client) {
  let hash = kBasis;
  setVersion(described.constants.CS_COLLIDER_VERSION);
  for (let index = 0; core.cs_get_played_collider(client, index, scratch) !== 0; ++index)
    hash = fnv1a(bytes(scratch + kCollider.position, 28), hash);
  return hash;
}

function observe(client, events) {
  setVersion(described.constants.CS_STATISTICS_VERSION);
  core.cs_get_statistics(client, 0n, scratch);
  const view = new DataView(core.memory.buffer, scratch);
  const [tick, decodeErrors, hashMismatches] = ["tick", "decode_errors", "hash_mismatches"].map((name) => view.getBigUint64(kStatistics[name], true));
  const vertices = core.cs_vertex_count(client);
  const colliders = hex64(playedCollidersHash(client));
  core.cs_triangles(client, scratch);
  return {
    events,
    state: core.cs_get_state(client),
    tick: String(tick),
    decodeErrors: Number(decodeErrors),
    hashMismatches: Number(hashMismatches),
    reconstructionHash: hex64(core.cs_reconstruction_hash(client)),
    positionsHash: hex64(floatsHash(core.cs_positions(client), vertices)),
    normalsHash: hex64(floatsHash(core.cs_normals(client), vertices)),
    playedPositionsHash: hex64(floatsHash(core.cs_played_positions(client), vertices)),
    playedNormalsHash: hex64(floatsHash(core.cs_played_normals(client), vertices)),
    playedCollidersHash: colliders,
    triangleCount: word(scratch) / 3,
    outgoingHash: hex64(outgoingHash(client)),
    errorText: Buffer.from(text(core.cs_error_text(client))).toString("hex"),
  };
}

function replay(session) {
  const names = [copyIn(Buffer.from("curtain\0")), copyIn(Buffer.from("test\0"))];
  bytes(scratch, 256).fill(0);
  setVersion(described.constants.CS_CLIENT_OPTIONS_VERSION);
  const view = new DataView(core.memory.buffer, scratch);
  view.setUint32(kOptions.scene, names[0], true);
  view.setUint32(kOptions.client_name, names[1], true);
  const client = core.cs_create(scratch);
  names.forEach(core.free);
  core.cs_default_play_out(scratch);
  new DataView(core.memory.buffer, scratch).setFloat64(kPlayOut.delay_ms, playOutDelayMs, true);
  assert.equal(core.cs_set_play_out(client, scratch), 1);
  const observations = session.messages.map((message, index) => {
    const nowUs = BigInt(index * stepUs);
    const data = Buffer.from(message, "hex");
    const pointer = copyIn(data);
    const events = core.cs_receive(client, pointer, data.length, nowUs);
    core.free(pointer);
    core.cs_update(client, nowUs);
    core.cs_play_out(client, nowUs, nowUs, 0);
    return observe(client, events);
  });
  core.cs_destroy(client);
  return observations;
}

assert(sessions.length > 300);
let decoded = 0;
let failed = 0;
for (const session of sessions) {
  const observations = replay(session);
  assert.deepEqual(observations, session.expected, session.name);
  decoded += observations.filter(({ events }) => events === 1).length;
  failed += observations.at(-1).state === 2;

  const stream = golden.find(({ name }) => session.name === `golden ${name}`);
  if (!stream) continue;
  const { packets, refused = [] } = stream;
  const frames = observations.slice(-packets.length - refused.length);
  packets.forEach((packet, index) => {
    const { positionsHash, reconstructionHash } = packet;
    assert.deepEqual({ ...frames[index], positionsHash, reconstructionHash }, frames[index], packet.file);
  });
  const { reconstructionHash } = packets.at(-1);
  refused.forEach((file, index) => {
    const after = frames[packets.length + index];
    assert.deepEqual({ ...after, decodeErrors: index + 1, reconstructionHash }, after, file);
  });
  stream.seen = true;
}
assert(golden.every(({ seen }) => seen), "every golden stream was replayed");
assert(failed > 50, "corrupted bytes were detected");
const decodedPositions = new Set(sessions[0].expected.map(({ positionsHash }) => positionsHash));
const blended = sessions[0].expected.filter(({ playedPositionsHash }) => !decodedPositions.has(playedPositionsHash));
assert(blended.length > 3, "play-out interpolated between frames");
const growth = core.memory.buffer.byteLength;
for (let run = 0; run < 200; ++run) replay(sessions[0]);
assert.equal(core.memory.buffer.byteLength, growth, "destroyed clients leak no memory");
console.log(`${sessions.length} sessions, ${decoded} frames decoded, ${failed} refused; memory ${growth >> 10} KiB`);
