// SPDX-License-Identifier: MIT
// The client core in WebAssembly, and the side of the worker: memory, a client before it has joined, and the messages
// between the threads. CLOTHSTREAM_CORE_WASM is the path of the core; default: that of the build `release`.

import { readFileSync } from "node:fs";
import { afterEach, assert, beforeEach, test, vi } from "vitest";
import { Client } from "../../../clients/web/client/src/client";
import { Connection } from "../../../clients/web/client/src/connection";
import { CS_CLOTH_POINT_VERSION, cs_cloth_point } from "../../../clients/web/client/src/layout";
import type { FromWorker } from "../../../clients/web/client/src/thread_messages";
import { ClientState, kMaxGrabs } from "../../../clients/web/client/src/types";
import { CoreModule } from "../../../clients/web/client/src/wasm";
import { FakeSocket } from "./fake_socket";

const kBuilt = new URL("../../../build/release/web-wasm/clothstream_core.wasm", import.meta.url);
const module = new WebAssembly.Module(readFileSync(process.env["CLOTHSTREAM_CORE_WASM"] ?? kBuilt));
const kIdentity = { name: "Ada", role: 0 };
const textOf = (bytes: Uint8Array) => new TextDecoder().decode(bytes);

test("text and numbers are copied to the core and back", async () => {
  const core = await CoreModule.start(module);
  const text = "Füße 布 🧵";
  assert.equal(core.with([text], (pointer) => core.text(pointer!)), text);
  assert.equal(core.text(0), "");
  core.with([undefined, [1, 2.5, -3]], (none, numbers) => {
    assert.equal(none, 0);
    assert.deepEqual([...core.floats(numbers!, 3)], [1, 2.5, -3]);
  });
  assert.throws(() => core.with(["text"], () => assert.fail("from the caller")), "from the caller");
});

test("a file that is not the core is refused with what to do", async () => {
  vi.stubGlobal("fetch", () => Promise.resolve(new Response("<!doctype html>")));
  const error: unknown = await CoreModule.compile("/core.wasm").catch((reason: unknown) => reason);
  assert.include(String(error), "/core.wasm is not a WebAssembly module");
  vi.stubGlobal("fetch", () => Promise.resolve(new Response("", { status: 404, statusText: "Not Found" })));
  assert.include(String(await CoreModule.compile("/core.wasm").catch((reason: unknown) => reason)), "404 Not Found");
});

test("memory that the core gives back is used again", async () => {
  const core = await CoreModule.start(module);
  const numbers = new Array<number>(100_000).fill(1);
  core.with([numbers], () => undefined);
  const { byteLength } = core.exports.memory.buffer;
  for (let i = 0; i < 100; ++i) core.with([numbers], () => undefined);
  assert.equal(core.exports.memory.buffer.byteLength, byteLength);
});

test("a client that has not joined knows nothing of a scene, and sends no requests", async () => {
  const client = new Client(await CoreModule.start(module), "whole", "flag", "test", kIdentity);
  assert.equal(client.state, ClientState.joining);
  assert.deepEqual(client.frames.cloths(), []);
  assert.deepEqual(client.frames.colliders(), []);
  assert.lengthOf(client.frames.positions(), 0);
  assert.isUndefined(client.frames.castRay([0, 1, 3], [0, 0, -1]));
  assert.isUndefined(client.parameters.environment());
  assert.isUndefined(client.parameters.report(0));
  assert.isUndefined(client.settings.of(0));
  assert.isUndefined(client.playback.state());
  assert.deepEqual(client.people.participants(), []);
  assert.equal(client.requests.reset(""), 0n);
  client.destroy();
});

test("Hello names scene, program and person, and a token comes first", async () => {
  const client = new Client(await CoreModule.start(module), "whole", "flag", "test", kIdentity);
  client.setToken("secret");
  client.connecting(1_000_000n);
  const [proof, hello] = [client.nextOutgoing()!, client.nextOutgoing()!].map(textOf);
  assert.include(proof, "secret");
  for (const name of ["flag", "test", "Ada"]) assert.include(hello, name);
  assert.isUndefined(client.nextOutgoing());
  client.destroy();
});

test("more grabs than allowed are ignored, and bytes that are no message end the client with a reason", async () => {
  const client = new Client(await CoreModule.start(module), "whole", "", "test", kIdentity);
  const grab = { position: [0, 1, 0] as const, place: new Uint8Array(cs_cloth_point.sizeof) };
  grab.place[cs_cloth_point.version] = CS_CLOTH_POINT_VERSION;
  client.input.setGrabs(Array.from({ length: kMaxGrabs + 5 }, (_, id) => ({ id: id + 1, ...grab })));
  assert.equal(client.state, ClientState.joining);
  client.receive(Uint8Array.of(255, 255, 255), 0n);
  assert.equal(client.state, ClientState.failed);
  assert.isNotEmpty(client.errorText);
  client.destroy();
});

// Frames are posted as numbers.
const posted: Exclude<FromWorker, number>[] = [];
let connection: Connection | undefined;
const socket = () => FakeSocket.made.at(-1)!;

beforeEach(() => {
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.made = [];
  posted.length = 0;
});
afterEach(() => {
  void connection?.leave();
  connection = undefined;
  vi.unstubAllGlobals();
});

async function connect(resumeToken = "", follows = true): Promise<Connection> {
  connection = await Connection.start(
    { postMessage: (message) => typeof message !== "number" && posted.push(message) },
    {
      kind: "start",
      session: 7,
      module,
      url: "wss://server:8443/stream",
      follows,
      scene: "flag",
      program: "test",
      identity: kIdentity,
      proof: { token: "" },
      resumeToken,
      quality: 0,
      pageOrigin: performance.timeOrigin,
      shares: false,
    },
  );
  return connection;
}

test("messages of the page wait for the connection, and come after Hello", async () => {
  const started = await connect();
  assert.deepEqual(posted.map(({ kind, session }) => [kind, session]), [["connecting", 7]]);
  started.handle({ kind: "send", connection: 1, message: Uint8Array.of(1) });
  started.handle({ kind: "send", connection: 99, message: Uint8Array.of(2) });
  assert.lengthOf(socket().sent, 0);
  socket().opens();
  const [hello, message, ...more] = socket().sent as Uint8Array[];
  assert.include(textOf(hello!), "flag");
  assert.deepEqual(message, Uint8Array.of(1));
  assert.lengthOf(more, 0);
});

test("a resume token is sent with Hello, and other text is ignored", async () => {
  const sent = async (token: string) => {
    const started = await connect(token);
    socket().opens();
    void started.leave();
    return textOf(socket().sent[0] as Uint8Array);
  };
  assert.include(await sent("50697a7a61-3"), "Pizza");
  assert.notInclude(await sent("Pizza"), "Pizza");
  connection = undefined;
});

test("leaving ends when the socket is closed, and its code says whether the page may return", async () => {
  for (const [returns, code] of [[false, undefined], [true, 4001]] as const) {
    const started = await connect();
    socket().opens();
    let left = false;
    const leaving = started.leave(returns).then(() => (left = true));
    await Promise.resolve();
    assert.isTrue(socket().closed && !left);
    assert.equal(socket().closeCode, code);
    socket().onclose?.({ reason: "", wasClean: true });
    await leaving;
  }
  connection = undefined;
});

test("a lost connection is reported with the time of the next attempt, and can be opened at once", async () => {
  const started = await connect();
  const lose = () => socket().onclose?.({ reason: "", wasClean: false });
  // The first attempt follows at once, the second one after at least 25 ms.
  lose();
  started.handle({ kind: "reconnect" });
  lose();
  const lost = posted.at(-1)!;
  assert.isTrue(lost.kind === "lost" && lost.reason === "The server cannot be reached." && lost.attemptAtMs > lost.atMs + 20);
  const sockets = FakeSocket.made.length;
  started.handle({ kind: "reconnect" });
  assert.lengthOf(FakeSocket.made, sockets + 1);
  const again = posted.at(-1)!;
  assert.isTrue(again.kind === "connecting");
  // Messages for an earlier connection are dropped.
  started.handle({ kind: "send", connection: 1, message: Uint8Array.of(1) });
  socket().opens();
  assert.lengthOf(socket().sent, 1);
});

test("messages of the server are passed on to the page", async () => {
  await connect();
  socket().opens();
  const bytes = new ArrayBuffer(0);
  socket().onmessage?.({ data: bytes });
  const message = posted.at(-1)!;
  assert.isTrue(message.kind === "message" && message.message === bytes && message.frame === undefined);
});

// A fatal Error (session.proto) of a server that does not have the scene.
function notFound(server: string): ArrayBuffer {
  const field = (number: number, bytes: number[]) => [(number << 3) | 2, bytes.length, ...bytes];
  const text = (value: string) => [...new TextEncoder().encode(value)];
  const error = [0x08, 3, ...field(2, text("elsewhere")), 0x18, 1, ...field(4, text(server))];
  return Uint8Array.from(field(8, error)).buffer;
}

test("a scene at another server is joined there, with the scheme, port and path of the URL", async () => {
  await connect();
  socket().opens();
  socket().onmessage?.({ data: notFound("b.example") });
  assert.isFalse(socket().closed, "the server closes the connection");
  socket().onclose?.({ reason: "", wasClean: true });
  assert.equal(socket().url, "wss://b.example:8443/stream");
  socket().opens();
  assert.include(textOf(socket().sent[0] as Uint8Array), "flag");
  assert.isFalse(socket().closed);
});

test("a name is not followed if it is no DNS name, or if a secret would go without TLS", async () => {
  for (const [server, follows] of [["192.0.2.1", true], ["b.example:80", true], ["b.example", false]] as const) {
    const started = await connect("", follows);
    const { length } = FakeSocket.made;
    socket().opens();
    socket().onmessage?.({ data: notFound(server) });
    assert.isTrue(socket().closed, `${server}: the client has failed`);
    assert.lengthOf(FakeSocket.made, length);
    void started.leave();
  }
  connection = undefined;
});
