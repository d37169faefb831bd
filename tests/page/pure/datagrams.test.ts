// SPDX-License-Identifier: MIT
// Datagrams in the worker: between the data channel, the client core and the WebSocket. CLOTHSTREAM_CORE_WASM is the path
// of the core; default: that of the build `release`.

import { readFileSync } from "node:fs";
import { afterEach, assert, beforeEach, test, vi } from "vitest";
import { Connection } from "../../../clients/web/client/src/connection";
import { Datagrams } from "../../../clients/web/client/src/datagrams";
import type { FromWorker } from "../../../clients/web/client/src/thread_messages";
import { CoreModule } from "../../../clients/web/client/src/wasm";
import { FakeChannel } from "./fake_peer";
import { FakeSocket } from "./fake_socket";

const kBuilt = new URL("../../../build/release/web-wasm/clothstream_core.wasm", import.meta.url);
const module = new WebAssembly.Module(readFileSync(process.env["CLOTHSTREAM_CORE_WASM"] ?? kBuilt));

// Kinds of datagrams (docs/datagrams.md).
const kInput = 2;
const kReceipt = 4;

// The only piece of a frame. The message has an unknown field, and is no Frame of a scene.
const kMessage = Uint8Array.of(0xfa, 0x3f, 2, 7, 7);
function piece(packet: number, frame: number, message = kMessage): ArrayBuffer {
  const bytes = new Uint8Array(19 + message.length);
  const view = new DataView(bytes.buffer);
  view.setUint8(0, 1);
  view.setUint32(1, packet, true);
  view.setUint32(9, frame, true);
  view.setUint8(14, 1);
  view.setUint32(15, message.length, true);
  bytes.set(message, 19);
  return bytes.buffer;
}

// ClientMessage.collider_poses (session.proto), empty.
const kPoses = Uint8Array.of((3 << 3) | 2, 0);

let channel: FakeChannel;
let datagrams: Datagrams | undefined;
let nowMs = 1000;
const events: string[] = [];
const kinds = () => channel.sent.map((datagram) => datagram[0]);

async function open(message: (bytes: Uint8Array) => void = (bytes) => events.push(`message ${bytes.length}`)): Promise<Datagrams> {
  datagrams = new Datagrams(
    await CoreModule.start(module),
    channel as unknown as RTCDataChannel,
    {
      opened: () => events.push("opened"),
      message,
      streamMessage: (bytes) => events.push(`stream ${bytes.length}`),
      closed: () => events.push("closed"),
    },
    () => nowMs,
  );
  return datagrams;
}

beforeEach(() => {
  vi.useFakeTimers();
  channel = new FakeChannel();
  events.length = 0;
  nowMs = 1000;
});
afterEach(() => {
  datagrams?.close();
  datagrams = undefined;
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const pass = (milliseconds: number) => {
  nowMs += milliseconds;
  vi.advanceTimersByTime(milliseconds);
};

test("a frame is handed on, and a receipt answers", async () => {
  const opened = await open();
  assert.equal(channel.binaryType, "arraybuffer");
  channel.opens();
  channel.onmessage?.({ data: piece(0, 0) });
  assert.deepEqual(events, ["opened", `message ${kMessage.length}`]);
  assert.include(kinds(), kReceipt);
  const { inUse, packets, frames } = opened.statistics();
  assert.deepEqual([inUse, packets, frames], [true, 1, 1]);
});

test("a timer sends what is due", async () => {
  await open();
  channel.opens();
  channel.onmessage?.({ data: piece(0, 0) });
  // Frame 2 has no frame 1 before it: the core asks for it.
  pass(5);
  channel.onmessage?.({ data: piece(2, 2) });
  const { length } = channel.sent;
  pass(200);
  assert.isAbove(channel.sent.length, length);
  assert.equal(events.filter((event) => event.startsWith("message")).length, 2, "frame 1 is given up");
});

test("input travels in datagrams while they arrive", async () => {
  const opened = await open();
  channel.opens();
  opened.send(kPoses);
  assert.equal(events.pop(), "stream 2", "nothing has arrived yet");
  channel.onmessage?.({ data: piece(0, 0) });
  events.length = 0;
  opened.send(kPoses);
  assert.include(kinds(), kInput);
  assert.deepEqual(events, []);
  pass(600);
  assert.isFalse(opened.statistics().inUse);
  events.length = 0;
  opened.send(kPoses);
  assert.deepEqual(events, ["stream 2"]);
});

test("a full channel drops datagrams", async () => {
  const opened = await open();
  channel.opens();
  channel.onmessage?.({ data: piece(0, 0) });
  channel.bufferedAmount = 1 << 20;
  const { length } = channel.sent;
  opened.send(kPoses);
  assert.lengthOf(channel.sent, length);
  channel.bufferedAmount = 0;
  opened.send(kPoses);
  assert.isAbove(channel.sent.length, length);
});

test("what a listener sends changes no order", async () => {
  const opened = await open((message) => {
    events.push(`begin ${message.length}`);
    opened.send(kPoses);
    events.push(`end ${message.length}`);
  });
  channel.opens();
  // Frame 1 waits for frame 0, which then hands on both.
  channel.onmessage?.({ data: piece(1, 1, Uint8Array.of(0xfa, 0x3f, 1, 7)) });
  channel.onmessage?.({ data: piece(0, 0) });
  assert.deepEqual(events, ["opened", "begin 5", "end 5", "begin 4", "end 4"]);
  assert.include(kinds(), kInput);
});

test("messages of the stream are handed on at once", async () => {
  const opened = await open();
  opened.receiveFromStream(Uint8Array.of(0xfa, 0x3f, 1, 1));
  assert.deepEqual(events, ["message 4"]);
});

test("a listener may close the datagrams", async () => {
  await open(() => {
    datagrams?.close();
    datagrams = undefined;
  });
  channel.opens();
  channel.onmessage?.({ data: piece(0, 0) });
  assert.equal(channel.readyState, "closed");
  assert.deepEqual([channel.onmessage, channel.onclose], [null, null]);
});

// The worker's side of a session.
const posted: Exclude<FromWorker, number>[] = [];
const socket = () => FakeSocket.made.at(-1)!;
let connection: Connection | undefined;

async function connect(): Promise<Connection> {
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.made = [];
  posted.length = 0;
  connection = await Connection.start(
    { postMessage: (message) => typeof message !== "number" && posted.push(message) },
    {
      kind: "start",
      session: 7,
      module,
      url: "ws://server/stream",
      follows: true,
      scene: "flag",
      program: "test",
      identity: { name: "", role: 0 },
      proof: { token: "" },
      resumeToken: "",
      quality: 0,
      pageOrigin: performance.timeOrigin,
      shares: false,
    },
  );
  return connection;
}
afterEach(() => {
  void connection?.leave();
  connection = undefined;
});

const field = (number: number, bytes: number[]) => [...varint((number << 3) | 2), ...varint(bytes.length), ...bytes];
const varint = (value: number): number[] => (value < 128 ? [value] : [(value & 127) | 128, ...varint(value >> 7)]);
const text = (value: string) => [...new TextEncoder().encode(value)];

const kOffer = { ufrag: "2rl4", password: "zgW3Um2rzsROYUKLk/JSr4rl", fingerprint: Uint8Array.from({ length: 32 }, (_, index) => index) };
const offer = (to: Connection, association: number) => {
  to.handle({ kind: "channel", connection: 1, association, channel: channel as unknown as RTCDataChannel });
  to.handle({ kind: "offer", association, offer: kOffer });
};

test("an offer follows Hello at once", async () => {
  const started = await connect();
  offer(started, 1);
  socket().opens();
  const [hello, sent, ...more] = (socket().sent as Uint8Array[]).map((bytes) => new TextDecoder().decode(bytes));
  assert.include(hello, "flag");
  assert.include(sent, kOffer.password);
  assert.lengthOf(more, 0);
});

test("the answer and the channel are reported", async () => {
  const started = await connect();
  socket().opens();
  offer(started, 3);
  const answer = [
    ...field(1, text("srv1")),
    ...field(2, text("p".repeat(22))),
    ...field(3, Array.from({ length: 32 }, () => 9)),
    ...field(4, text("192.0.2.1")),
    ...field(4, text("2001:db8::1")),
    ...[5 << 3, ...varint(8080)],
  ];
  socket().onmessage?.({ data: Uint8Array.from(field(70, answer)).buffer });
  const answered = posted.find(({ kind }) => kind === "answered");
  assert.deepEqual(answered, {
    kind: "answered",
    session: 7,
    association: 3,
    answer: { ufrag: "srv1", password: "p".repeat(22), fingerprint: new Uint8Array(32).fill(9), addresses: ["192.0.2.1", "2001:db8::1"], port: 8080 },
  });
  channel.opens();
  assert.deepEqual(posted.at(-1), { kind: "channel", session: 7, association: 3, isOpen: true });
  vi.advanceTimersByTime(60);
  const said = posted.findIndex(({ kind }) => kind === "datagrams");
  assert.isAbove(said, 0);
  channel.loses();
  assert.deepEqual(posted.at(-1), { kind: "channel", session: 7, association: 3, isOpen: false });
});

test("input of the page travels in datagrams", async () => {
  const started = await connect();
  socket().opens();
  offer(started, 1);
  channel.opens();
  channel.onmessage?.({ data: piece(0, 0) });
  const { length } = socket().sent;
  started.handle({ kind: "send", connection: 1, message: kPoses.slice() });
  assert.include(kinds(), kInput);
  assert.lengthOf(socket().sent, length);
  started.handle({ kind: "send", connection: 1, message: Uint8Array.of(0xfa, 0x3f, 0) });
  assert.deepEqual(socket().sent.at(-1), Uint8Array.of(0xfa, 0x3f, 0), "other messages travel on the stream");
});

test("a lost connection ends its datagrams", async () => {
  const started = await connect();
  socket().opens();
  offer(started, 1);
  socket().onclose?.({ reason: "", wasClean: false });
  assert.equal(channel.readyState, "closed");
  // The page's channel for the connection that was lost comes late.
  channel = new FakeChannel();
  offer(started, 2);
  assert.isNull(channel.onopen);
  socket().opens();
  assert.lengthOf(socket().sent, 1, "only Hello");
});
