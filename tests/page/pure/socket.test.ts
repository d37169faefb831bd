// SPDX-License-Identifier: MIT
// The WebSocket of the worker: its states, and reasons for people when it closes.

import { afterEach, assert, beforeEach, test, vi } from "vitest";
import { StreamSocket } from "../../../clients/web/client/src/socket";
import { FakeSocket, type Closed } from "./fake_socket";

const events: string[] = [];
let socket: StreamSocket;
const last = () => FakeSocket.made.at(-1)!;

beforeEach(() => {
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.made = [];
  events.length = 0;
  socket = new StreamSocket("ws://server/stream", {
    opened: () => events.push("opened"),
    message: (bytes) => events.push(`message of ${bytes.byteLength} bytes`),
    lost: (reason) => events.push(reason),
  });
});
afterEach(() => vi.unstubAllGlobals());

test("messages are sent only while the socket is open", () => {
  socket.send(Uint8Array.of(1));
  socket.open("");
  assert.isTrue(socket.inUse);
  assert.isFalse(socket.isOpen);
  socket.send(Uint8Array.of(2));
  last().opens();
  socket.send(Uint8Array.of(3));
  assert.deepEqual(last().sent, [Uint8Array.of(3)]);
  assert.deepEqual([last().url, last().binaryType], ["ws://server/stream", "arraybuffer"]);
});

test("a named server replaces the host of the URL for one connection", () => {
  const urlAt = (url: string, server: string) => {
    const one = new StreamSocket(url, { opened: () => undefined, message: () => undefined, lost: () => undefined });
    one.open(server);
    return last().url;
  };
  assert.equal(urlAt("wss://a.example:8443/path/stream?x=1", "b.example"), "wss://b.example:8443/path/stream?x=1");
  assert.equal(urlAt("ws://[::1]:8080/stream", "b.example"), "ws://b.example:8080/stream");
  assert.equal(urlAt("wss://a.example/stream", "b.example"), "wss://b.example/stream");
  assert.equal(urlAt("wss://a.example/stream", ""), "wss://a.example/stream");
});

test("text of a server is ignored, bytes are passed on", () => {
  socket.open("");
  last().opens();
  last().onmessage?.({ data: "text" });
  last().onmessage?.({ data: new ArrayBuffer(3) });
  assert.deepEqual(events, ["opened", "message of 3 bytes"]);
});

test("the reason of a lost connection says what happened", () => {
  const cases: [boolean, Closed, string][] = [
    [false, { reason: "", wasClean: false }, "The server cannot be reached."],
    [true, { reason: "the scene ended", wasClean: true }, "The server closed the connection: the scene ended."],
    [true, { reason: "", wasClean: true }, "The server closed the connection."],
    [true, { reason: "", wasClean: false }, "The connection was lost."],
  ];
  for (const [opens, closed, reason] of cases) {
    socket.open("");
    if (opens) last().opens();
    last().onclose?.(closed);
    assert.equal(events.at(-1), reason);
    assert.isFalse(socket.inUse);
  }
});

test("a socket that is closed or replaced reports nothing more", async () => {
  socket.open("");
  const first = last();
  socket.open("");
  assert.isTrue(first.closed);
  const closing = socket.close();
  assert.isTrue(last().closed);
  assert.isFalse(socket.inUse);
  for (const one of [first, last()]) {
    assert.deepEqual([one.onopen, one.onmessage], [null, null]);
    one.onclose?.({ reason: "", wasClean: true });
  }
  await closing;
  await socket.close();
  assert.deepEqual(events, []);
});

test("a prepared socket is used for its server, open or not", () => {
  for (const opens of [true, false]) {
    events.length = 0;
    socket.open("");
    const first = last();
    socket.prepare("b.example");
    const prepared = last();
    assert.equal(prepared.url, "ws://b.example/stream");
    if (opens) prepared.opens();
    assert.deepEqual(events, [], "nothing is reported before it is used");
    socket.open("b.example");
    assert.strictEqual(last(), prepared);
    assert.isTrue(first.closed);
    if (!opens) prepared.opens();
    assert.deepEqual(events, ["opened"]);
    socket.send(Uint8Array.of(1));
    assert.lengthOf(prepared.sent, 1);
    void socket.close();
  }
});

test("a prepared socket that is not used is closed", () => {
  socket.open("");
  socket.prepare("b.example");
  const other = last();
  socket.prepare("c.example");
  assert.isTrue(other.closed);
  const prepared = last();
  prepared.readyState = 3; // the server has closed it
  socket.open("c.example");
  assert.notStrictEqual(last(), prepared);
  socket.prepare("d.example");
  const unused = last();
  void socket.close();
  assert.isTrue(unused.closed);
});
