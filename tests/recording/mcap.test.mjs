// SPDX-License-Identifier: MIT
// MCAP's own reader reads our recordings whole: from end to end, and by their index.
// Usage: node mcap.test.mjs RECORDING [FRAMES]
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const fzstd = require("fzstd");

const [path, frames] = process.argv.slice(2);
const bytes = readFileSync(path);
const decompressHandlers = { zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))) };

// Checksums of chunks and of all data are compared on the way.
const counts = new Map();
const topics = new Map();
let chunks = 0;
let statistics;
let lastTime = 0n;
const stream = new McapStreamReader({ includeChunks: true, decompressHandlers, validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Channel") topics.set(record.id, record.topic);
  if (record.type === "Chunk") ++chunks;
  if (record.type === "Statistics") statistics = record;
  if (record.type !== "Message") continue;
  assert.ok(record.logTime >= lastTime, "messages are in the order of their times");
  lastTime = record.logTime;
  counts.set(record.channelId, (counts.get(record.channelId) ?? 0n) + 1n);
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
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  assert.ok(topics.has(message.channelId));
  ++indexedMessages;
}
assert.equal(indexedMessages, statistics.messageCount);
let facts = 0;
for await (const metadata of indexed.readMetadata({ name: "clothstream" })) facts += metadata.metadata.size;
assert.ok(facts > 0, "its facts are found");

const topicCounts = Object.fromEntries([...counts].map(([id, count]) => [topics.get(id), Number(count)]));
if (frames !== undefined) assert.equal(topicCounts["/frames"], Number(frames));
console.log(JSON.stringify(topicCounts));
