// SPDX-License-Identifier: MIT
// Reads a file of `clothstream encode` as the ServerMessages of a stream, and decodes them with the client core.
import { readFileSync } from "node:fs";

const kName = "clothstream\n";
const kChunkBytes = 256 * 1024;
const kVarint = 0;
const kBytes = 2;

function varint(value) {
  const bytes = [];
  for (; value >= 0x80; value = Math.floor(value / 0x80)) bytes.push((value % 0x80) | 0x80);
  return Buffer.from([...bytes, value]);
}
const number = (field, value) => Buffer.concat([varint(field * 8 + kVarint), varint(value)]);
const bytes = (field, value) => Buffer.concat([varint(field * 8 + kBytes), varint(value.length), value]);

class Reader {
  constructor(buffer) {
    this.buffer = buffer;
    this.at = 0;
  }
  get more() {
    return this.at < this.buffer.length;
  }
  varint() {
    let value = 0;
    for (let scale = 1; ; scale *= 0x80) {
      const byte = this.buffer[this.at++];
      value += (byte & 0x7f) * scale;
      if (byte < 0x80) return value;
    }
  }
  take(count) {
    if (this.at + count > this.buffer.length) throw new Error("the recording ends too early");
    return this.buffer.subarray(this.at, (this.at += count));
  }
  // Yields for each field its number, all of its bytes, and its value if that is a number or bytes.
  *fields() {
    while (this.more) {
      const start = this.at;
      const tag = this.varint();
      const kind = tag & 7;
      const value = kind === kVarint ? this.varint() : this.take(kind === kBytes ? this.varint() : kind === 1 ? 8 : 4);
      yield { field: tag >> 3, whole: this.buffer.subarray(start, this.at), value };
    }
  }
}

// Rest positions are part of a server's description and say how many vertices exist. A recording omits them.
function withRestPositions(description) {
  return Buffer.concat(
    [...new Reader(description).fields()].map(({ field, whole, value }) => {
      if (field !== 8) return whole;
      const vertices = [...new Reader(value).fields()].find((of) => of.field === 2).value;
      return bytes(8, Buffer.concat([value, bytes(5, Buffer.alloc(12 * vertices))]));
    }),
  );
}

// Returns serialised ServerMessages: those before the first frame, and one per frame.
export function readRecording(path) {
  const reader = new Reader(readFileSync(path));
  if (reader.take(kName.length).toString() !== kName) throw new Error(`${path} is not what clothstream encode writes`);
  const frameCount = reader.take(8).readUint32LE(0);
  const description = reader.take(reader.varint());
  const codec = [...new Reader(description).fields()].find(({ field }) => field === 2).value;
  const content = withRestPositions(description);
  const count = Math.ceil(content.length / kChunkBytes);
  const before = [bytes(2, Buffer.concat([number(1, 1), number(2, codec), number(7, 1)]))];
  for (let index = 0; index < count; ++index) {
    const data = content.subarray(index * kChunkBytes, (index + 1) * kChunkBytes);
    before.push(
      bytes(3, Buffer.concat([number(1, 1), number(2, 1), number(3, index), number(4, count), number(5, content.length), bytes(6, data)])),
    );
  }
  const frames = [];
  while (reader.more) frames.push(bytes(4, reader.take(reader.varint())));
  if (frames.length !== frameCount) throw new Error(`${path} has ${frames.length} of ${frameCount} frames`);
  return { before, frames };
}

const { core: described } = JSON.parse(readFileSync(new URL("../../clients/interface/interface.json", import.meta.url), "utf8"));
const kStatistics = described.structs.cs_statistics.fields;
const kScratchBytes = 256;

export class Core {
  constructor(modulePath) {
    this.exports = new WebAssembly.Instance(new WebAssembly.Module(readFileSync(modulePath))).exports;
    this.exports._initialize();
    this.scratch = this.exports.malloc(kScratchBytes);
  }

  // Prepares the scratch memory for a struct of this version: zeros after the version.
  prepared(version) {
    new Uint8Array(this.exports.memory.buffer, this.scratch, kScratchBytes).fill(0);
    new DataView(this.exports.memory.buffer, this.scratch).setUint32(0, version, true);
    return this.scratch;
  }

  client() {
    return this.exports.cs_create(this.prepared(described.constants.CS_CLIENT_OPTIONS_VERSION));
  }

  // Returns a set of CS_EVENT bits. Outgoing messages are ignored.
  receive(client, message) {
    const { malloc, free, memory, cs_receive, cs_next_outgoing } = this.exports;
    const pointer = malloc(message.length);
    new Uint8Array(memory.buffer, pointer, message.length).set(message);
    const events = cs_receive(client, pointer, message.length, 0n);
    free(pointer);
    while (cs_next_outgoing(client, this.scratch) !== 0);
    return events;
  }

  // Number of decoded frames whose hash matches the encoder's.
  goodFrames(client) {
    this.exports.cs_get_statistics(client, 0n, this.prepared(described.constants.CS_STATISTICS_VERSION));
    const view = new DataView(this.exports.memory.buffer, this.scratch);
    const read = (name) => Number(view.getBigUint64(kStatistics.find((field) => field.name === name).offset.wasm32, true));
    return read("frames") - read("hash_mismatches");
  }

  floats(pointer, client) {
    return new Float32Array(this.exports.memory.buffer, pointer, 3 * this.exports.cs_vertex_count(client));
  }
}
