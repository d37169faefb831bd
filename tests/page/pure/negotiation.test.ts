// SPDX-License-Identifier: MIT
// How a page opens datagrams: what it offers, when it gives up, and when it tries again.

import { afterEach, assert, beforeEach, test, vi } from "vitest";
import { Negotiation } from "../../../clients/web/client/src/negotiation";
import type { ToWorker } from "../../../clients/web/client/src/thread_messages";
import type { DatagramStatistics, Transport } from "../../../clients/web/client/src/types";
import { FakePeer, kBrowserDescription, type FakeChannel } from "./fake_peer";

const kAnswer = { ufrag: "srv1", password: "p".repeat(22), fingerprint: new Uint8Array(32), addresses: ["192.0.2.1"], port: 8080 };
const kStatistics: DatagramStatistics = {
  inUse: true,
  packets: 10,
  lostPackets: 1,
  parityPackets: 2,
  frames: 3,
  repairedFrames: 1,
  lostFrames: 0,
  requests: 1,
  heldFrames: 0,
};
const posted: ToWorker[] = [];
const required: string[] = [];
let transfers = true; // whether the browser transfers channels
let negotiation: Negotiation;

const make = (transport: Transport) =>
  new Negotiation(transport, {
    post: (message, transfer = []) => {
      if (!transfers && transfer.some((one) => !(one instanceof MessagePort))) throw new Error("DataCloneError");
      posted.push(message);
    },
    required: (reason) => required.push(reason),
  });
const peer = () => FakePeer.made.at(-1)!;
const association = () => (posted.filter(({ kind }) => kind === "channel").at(-1) as { association: number }).association;
const answered = (answer = kAnswer) => negotiation.handle({ kind: "answered", association: association(), answer });
const channel = (isOpen: boolean) => negotiation.handle({ kind: "channel", association: association(), isOpen });
const settle = () => vi.advanceTimersByTimeAsync(0);

async function open(): Promise<void> {
  negotiation.start(1);
  await settle();
  answered();
  await settle();
  channel(true);
}

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("RTCPeerConnection", FakePeer);
  FakePeer.made = [];
  FakePeer.description = kBrowserDescription;
  posted.length = required.length = 0;
  transfers = true;
  negotiation = make("auto");
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("the worker gets the channel, then the offer", async () => {
  negotiation.start(7);
  assert.deepEqual(posted, [{ kind: "channel", connection: 7, association: 1, channel: peer().channel as unknown as RTCDataChannel }]);
  assert.deepEqual([peer().channel?.label, peer().channel?.options], ["clothstream", { ordered: false, maxRetransmits: 0 }]);
  await settle();
  const offer = posted.at(-1)!;
  assert.isTrue(offer.kind === "offer" && offer.association === 1 && offer.offer.ufrag === "2rl4");
});

test("a channel that cannot be transferred is relayed", async () => {
  transfers = false;
  negotiation.start(1);
  const given = posted.at(-1)!;
  assert.isTrue(given.kind === "channel" && given.channel instanceof MessagePort);
  const port = (given as { channel: MessagePort }).channel;
  const arrived: unknown[] = [];
  vi.useRealTimers();
  port.onmessage = ({ data }: MessageEvent<unknown>) => arrived.push(data);
  const own: FakeChannel = peer().channel!;
  own.opens();
  own.onmessage?.({ data: Uint8Array.of(1, 2).buffer });
  port.postMessage(Uint8Array.of(3).buffer);
  await vi.waitFor(() => assert.lengthOf(own.sent, 1));
  assert.deepEqual([...own.sent[0]!], [3]);
  await vi.waitFor(() => assert.lengthOf(arrived, 2));
  assert.deepEqual([arrived[0], ...new Uint8Array(arrived[1] as ArrayBuffer)], ["opened", 1, 2]);
  own.loses();
  await vi.waitFor(() => assert.equal(arrived.at(-1), "closed"));
  port.close();
});

test("frames travel in datagrams while they arrive", async () => {
  await open();
  assert.include(peer().remote?.sdp, "192.0.2.1 8080 typ host");
  assert.equal(negotiation.link.transport, "websocket");
  negotiation.handle({ kind: "datagrams", association: 1, statistics: kStatistics });
  assert.deepEqual(negotiation.link, { transport: "datagrams", reason: "", statistics: kStatistics });
  const silent = { ...kStatistics, inUse: false };
  negotiation.handle({ kind: "datagrams", association: 1, statistics: silent });
  assert.deepEqual(negotiation.link, { transport: "websocket", reason: "No datagrams arrive at present.", statistics: silent });
  await vi.advanceTimersByTimeAsync(60_000);
  assert.lengthOf(FakePeer.made, 1, "an open channel is kept");
});

test("without WebRTC nothing is offered", () => {
  vi.stubGlobal("RTCPeerConnection", undefined);
  negotiation.start(1);
  assert.deepEqual(posted, []);
  assert.equal(negotiation.link.reason, "This browser has no WebRTC.");
});

test("a page that wants TCP offers nothing", () => {
  negotiation = make("tcp");
  negotiation.start(1);
  assert.lengthOf(FakePeer.made, 0);
  assert.equal(negotiation.link.reason, "The page does not ask for datagrams.");
});

test("the link says why there are no datagrams", async () => {
  const cases: [() => Promise<void> | void, RegExp][] = [
    [() => answered({ ...kAnswer, addresses: [] }), /^The server opens no datagrams\.$/],
    [() => (answered(), vi.advanceTimersByTimeAsync(30_000)).then(() => undefined), /^UDP port 8080 of the server cannot be reached\.$/],
    [() => (answered(), peer().enters("failed")), /^UDP port 8080 of the server cannot be reached\.$/],
    [() => channel(false), /^The server has closed the datagrams\.$/],
    [() => ((peer().refusal = new Error("bad line")), answered(), settle()).then(() => undefined), /^The browser opens no datagrams: bad line\.$/],
  ];
  for (const [happens, reason] of cases) {
    negotiation.start(1);
    await settle();
    assert.equal(negotiation.link.reason, "Datagrams are being opened.");
    await happens();
    assert.match(negotiation.link.reason, reason);
    assert.isTrue(peer().closed);
    const { length } = FakePeer.made;
    await vi.advanceTimersByTimeAsync(60_000);
    assert.lengthOf(FakePeer.made, length, "not again on this connection");
  }
});

test("a description without a fingerprint is not offered", async () => {
  FakePeer.description = "v=0\r\n";
  negotiation.start(1);
  await settle();
  assert.lengthOf(posted, 1);
  assert.include(negotiation.link.reason, "no user name, password or fingerprint");
});

test("lost datagrams are offered again, later each time", async () => {
  await open();
  for (const waitMs of [2000, 4000, 8000]) {
    const { length } = FakePeer.made;
    channel(false);
    await vi.advanceTimersByTimeAsync(waitMs - 1);
    assert.lengthOf(FakePeer.made, length);
    await vi.advanceTimersByTimeAsync(1);
    assert.lengthOf(FakePeer.made, length + 1);
    const offer = posted.at(-1)!;
    assert.isTrue(offer.kind === "offer" && offer.association === association());
  }
});

test("a new connection offers datagrams again, and forgets the old one", async () => {
  await open();
  const first = peer();
  negotiation.stop("The connection was lost.");
  assert.isTrue(first.closed);
  assert.equal(negotiation.link.reason, "The connection was lost.");
  negotiation.start(2);
  await settle();
  // Late messages of the worker about the first one.
  negotiation.handle({ kind: "answered", association: 1, answer: kAnswer });
  negotiation.handle({ kind: "channel", association: 1, isOpen: true });
  negotiation.handle({ kind: "datagrams", association: 1, statistics: kStatistics });
  assert.isUndefined(peer().remote);
  assert.deepEqual(negotiation.link, { transport: "websocket", reason: "Datagrams are being opened.", statistics: undefined });
  first.enters("failed");
  assert.isFalse(peer().closed);
});

test("a stopped page opens nothing more", async () => {
  negotiation.start(1);
  negotiation.stop("The session has ended.");
  await vi.advanceTimersByTimeAsync(60_000);
  assert.lengthOf(FakePeer.made, 1);
  assert.lengthOf(posted, 1, "the offer was not ready");
});

test("required datagrams end the session only before they open", async () => {
  negotiation = make("datagrams");
  negotiation.start(1);
  await settle();
  answered({ ...kAnswer, addresses: [] });
  assert.deepEqual(required, ["The server opens no datagrams."]);
  await open();
  channel(false);
  assert.lengthOf(required, 1);
});
