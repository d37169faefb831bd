// SPDX-License-Identifier: MIT
// The MCAP project's reader reads our recordings completely: from start to end, and by their index.
// Usage: node mcap.test.mjs RECORDING [--frames N] [--info CLOTHSTREAM]
//   --frames  expects N frames
//   --info    expects a server's recording, of which `clothstream info` reports what this reader finds
// A recording may be compressed with gzip.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { gunzipSync } from "node:zlib";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const fzstd = require("fzstd");

const { positionals, values: options } = parseArgs({
  allowPositionals: true,
  options: { frames: { type: "string" }, info: { type: "string" } },
});
const file = readFileSync(positionals[0]);
const bytes = file[0] === 0x1f && file[1] === 0x8b ? gunzipSync(file) : file;
const decompressHandlers = { zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))) };

const schemaOf = {
  "/description": "StreamDescription",
  "/frames": "Frame",
  "/reports": "SimulationReport",
  "/parameters": "ParameterChanged",
  "/events": "TickEvents",
  "/notices": "Notice",
  "/participants": "ParticipantEvent",
  "/scene": "RecordedScene",
  "/ticks": "RecordedTick",
  "/checkpoints": "Checkpoint",
};

// Also compares the checksums of chunks and of all data. A zero means that there is none.
const counts = new Map();
const sizes = new Map();
const topics = new Map();
let chunks = 0;
let statistics;
let lastTime = 0n;
const stream = new McapStreamReader({ includeChunks: true, decompressHandlers, validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Channel") topics.set(record.id, record.topic);
  if (record.type === "Chunk") {
    ++chunks;
    assert.notEqual(record.uncompressedCrc, 0);
    assert.equal(record.compression, "zstd");
  }
  if (record.type === "DataEnd") assert.notEqual(record.dataSectionCrc, 0);
  if (record.type === "Footer") assert.notEqual(record.summaryCrc, 0);
  if (record.type === "Statistics") statistics = record;
  if (record.type !== "Message") continue;
  assert.ok(record.logTime >= lastTime, "messages are in the order of their times");
  lastTime = record.logTime;
  counts.set(record.channelId, (counts.get(record.channelId) ?? 0n) + 1n);
  sizes.set(record.channelId, (sizes.get(record.channelId) ?? 0) + record.data.length);
}
assert.ok(stream.done(), "the file ends where it should");
assert.equal(statistics.chunkCount, chunks);
assert.deepEqual([...statistics.channelMessageCounts].sort(), [...counts].sort());

let indexedMessages = 0n;
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
assert.equal(indexed.chunkIndexes.length, chunks);
for (const schema of indexed.schemasById.values()) {
  assert.equal(schema.encoding, "protobuf");
  assert.match(schema.name, /^clothstream\.v1\./);
  assert.ok(schema.data.length > 0);
}
for (const channel of indexed.channelsById.values()) {
  assert.equal(channel.messageEncoding, "protobuf");
  assert.equal(indexed.schemasById.get(channel.schemaId).name, `clothstream.v1.${schemaOf[channel.topic]}`);
}
assert.deepEqual([...topics.values()].sort(), Object.keys(schemaOf).sort());
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  assert.ok(topics.has(message.channelId));
  ++indexedMessages;
}
assert.equal(indexedMessages, statistics.messageCount);
const facts = {};
for await (const { metadata } of indexed.readMetadata({ name: "clothstream" }))
  Object.assign(facts, Object.fromEntries(metadata));
assert.ok(Object.keys(facts).length > 0, "the metadata is found");

const found = Object.fromEntries(Object.keys(schemaOf).map((topic) => [topic, { messages: 0, bytes: 0 }]));
for (const [id, count] of counts) found[topics.get(id)] = { messages: Number(count), bytes: sizes.get(id) };
if (options.frames !== undefined) assert.equal(found["/frames"].messages, Number(options.frames));

if (options.info !== undefined) {
  for (const topic of ["/description", "/scene", "/checkpoints", "/ticks", "/frames"])
    assert.ok(found[topic].messages > 0, `a server wrote ${topic}`);
  const directory = mkdtempSync(join(tmpdir(), "clothstream-"));
  try {
    const path = join(directory, "recording.mcap");
    writeFileSync(path, bytes);
    const info = JSON.parse(execFileSync(options.info, ["info", "--json", path], { encoding: "utf8" }));
    assert.equal(info.whole, true);
    assert.equal(info.bytes, bytes.length);
    assert.equal(info.chunks, chunks);
    assert.deepEqual(info.channels, found);
    assert.deepEqual(info.facts, facts);
    const length = statistics.messageEndTime - statistics.messageStartTime;
    assert.ok(Math.abs(info.seconds - Number(length) * 1e-9) < 1e-6);
  } finally {
    rmSync(directory, { recursive: true });
  }
}
console.log(JSON.stringify(found));
