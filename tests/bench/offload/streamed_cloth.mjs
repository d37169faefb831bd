// SPDX-License-Identifier: MIT
// A client that receives the cloth: the page's client core, fed with the messages of the server.
//
// Nothing waits: clocks are simulated. A frame arrives kArrivalUs after its tick began, and is drawn at once,
// half a frame before its time has come. Play-out therefore interpolates between two frames, as in a headset.
import { readFileSync } from "node:fs";
import { copyIn } from "./case.mjs";

const kStartUs = 1_000_000; // of the first tick, on the server's clock
const kArrivalUs = 5_000;
const kDelayMs = 5 + 500 / 72;
const kBetween = 2; // cs_shown

const { core } = JSON.parse(readFileSync(new URL("../../../clients/interface/interface.json", import.meta.url), "utf8"));
// Offsets of members of a struct of core.h.
function offsetsOf(struct) {
  return Object.fromEntries(core.structs[struct].fields.map(({ name, offset }) => [name, offset.wasm32]));
}
const kOptions = offsetsOf("cs_play_out_options");
const kPlayed = offsetsOf("cs_played");
const kStatistics = offsetsOf("cs_statistics");
const { CS_CLIENT_OPTIONS_VERSION, CS_PLAYED_VERSION, CS_STATISTICS_VERSION } = core.constants;

function varint(value) {
  const bytes = [];
  for (; value >= 0x80; value = Math.floor(value / 0x80)) bytes.push((value % 0x80) | 0x80);
  return [...bytes, value];
}

// The ServerMessage that answers a ping of `nowUs`: Pong is field 5.
function pong(nowUs) {
  const body = [1 << 3, ...varint(nowUs), 2 << 3, ...varint(nowUs)];
  return Uint8Array.from([(5 << 3) | 2, body.length, ...body]);
}

export class StreamedCloth {
  constructor(module, of) {
    this.module = module;
    this.of = of;
    this.frames = of.frames.map(of.bytes);
    this.scratch = module.malloc(256);
    new Uint8Array(module.memory.buffer, this.scratch, 256).fill(0);
    this.view().setUint32(0, CS_CLIENT_OPTIONS_VERSION, true);
    this.client = module.cs_create(this.scratch);
    this.send(kStartUs);
    of.before.map(of.bytes).forEach((message) => this.receive(message, kStartUs));
    this.send(kStartUs); // a ping among them
    this.receive(pong(kStartUs), kStartUs);
    this.playOut();
  }

  destroy() {
    this.module.cs_destroy(this.client);
    this.module.free(this.scratch);
  }

  view() {
    return new DataView(this.module.memory.buffer, this.scratch);
  }

  playOut() {
    this.module.cs_default_play_out(this.scratch);
    this.view().setFloat64(kOptions.delay_ms, kDelayMs, true);
    if (this.module.cs_set_play_out(this.client, this.scratch) !== 1) throw new Error("play-out is refused");
  }

  receive(message, nowUs) {
    const pointer = copyIn(this.module, message);
    this.module.cs_receive(this.client, pointer, message.length, BigInt(nowUs));
    this.module.free(pointer);
  }

  // Takes what the client sends: acknowledgements and pings.
  send(nowUs) {
    this.module.cs_update(this.client, BigInt(nowUs));
    while (this.module.cs_next_outgoing(this.client, this.scratch) !== 0);
  }

  // Everything that a client does for a frame: receive, decode, answer, interpolate, compute normals.
  frame(index) {
    const nowUs = kStartUs + Math.round((index * 1e6) / this.of.rate) + kArrivalUs;
    this.receive(this.frames[index], nowUs);
    this.send(nowUs);
    this.view().setUint32(kPlayed.version, CS_PLAYED_VERSION, true);
    if (this.module.cs_play_out(this.client, BigInt(nowUs), BigInt(nowUs), this.scratch) !== 1)
      throw new Error("nothing is played");
    this.shown = this.view().getUint32(kPlayed.shown, true);
    this.positions = this.module.cs_played_positions(this.client);
    this.normals = this.module.cs_played_normals(this.client);
  }

  statistics() {
    this.view().setUint32(kStatistics.version, CS_STATISTICS_VERSION, true);
    this.module.cs_get_statistics(this.client, 0n, this.scratch);
    const view = this.view();
    return Object.fromEntries(
      ["frames", "dropped", "decode_errors", "hash_mismatches", "bytes"].map((name) => [
        name,
        Number(view.getBigUint64(kStatistics[name], true)),
      ]),
    );
  }
}

// Decodes the whole stream. Throws if a frame is refused, decodes to another state than the server's, or is not
// interpolated.
export function checkStream(module, of) {
  const cloth = new StreamedCloth(module, of);
  for (let index = 0; index < cloth.frames.length; ++index) {
    cloth.frame(index);
    if (index > 0 && cloth.shown !== kBetween) throw new Error(`frame ${index} is not interpolated`);
  }
  const seen = cloth.statistics();
  cloth.destroy();
  if (seen.frames !== of.frames.length || seen.dropped + seen.decode_errors + seen.hash_mismatches > 0)
    throw new Error(`of ${of.frames.length} frames the client decoded ${JSON.stringify(seen)}`);
}
