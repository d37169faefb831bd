// SPDX-License-Identifier: MIT
// What the page says about failures, and when, without a browser.

import { readFile } from "node:fs/promises";
import { assert, test } from "vitest";
import { ErrorCode, type SessionState } from "@clothstream/client";
import { FrameGaps } from "../../../clients/web/client/src/frame_gaps";
import { isHeadsetBrowser, kNoWebAssembly, kNoWebGl, notLoaded, whyNoHeadset } from "../../../clients/web/page/src/advice";
import { failureOf, type Failure, type FailureContext } from "../../../clients/web/page/src/failure";
import { LateFrames } from "../../../clients/web/page/src/late_frames";

const calm: FailureContext = { now: 5000, since: 4000, hasJoined: true, networkDenied: false, longestPauseMs: undefined };
const refusal = (code: number, reason = "no"): SessionState => ({ kind: "failed", cause: "server", code, reason });
const asking = (code: number, reason = "no", wasGiven = true): SessionState => ({ kind: "asking", code, reason, wasGiven });
const lost: SessionState = { kind: "reconnecting", reason: "The server cannot be reached.", attemptAt: 9000 };

function failure(state: SessionState, context: FailureContext): Failure {
  const found = failureOf(state, context);
  assert.ok(found);
  return found;
}

test("codes of errors are those of the protocol", async () => {
  const protocol = await readFile(new URL("../../../proto/clothstream/v1/session.proto", import.meta.url), "utf8");
  for (const [name, code] of Object.entries(ErrorCode)) {
    const symbol = `ERROR_CODE_${name.replace(/[A-Z]/g, "_$&").toUpperCase()}`;
    assert.match(protocol, new RegExp(`\\b${symbol} = ${code};`));
  }
});

test("every failure has its own words, and either a way on for the person or a new attempt of the page", () => {
  const said = "the server's words";
  const failures: (Failure | undefined)[] = [
    ...Object.values(ErrorCode).filter((code) => code < 60).map((code) => failureOf(refusal(code, said), calm)),
    failureOf(refusal(ErrorCode.removed, "an owner banned you from the scene"), calm),
    failureOf(refusal(7, said), calm),
    failureOf({ kind: "failed", cause: "client", code: 0, reason: said }, calm),
    failureOf({ kind: "failed", cause: "worker", code: 0, reason: said }, calm),
    failureOf({ kind: "failed", cause: "datagrams", code: 0, reason: said }, calm),
    failureOf(asking(ErrorCode.unauthenticated, said, false), calm),
    failureOf(asking(ErrorCode.unauthenticated, said), calm),
    failureOf(asking(ErrorCode.wrongPairingCode, said), calm),
    failureOf(asking(ErrorCode.wrongPairingCode, "try again in a minute"), calm),
    failureOf(lost, calm),
    failureOf(lost, { ...calm, networkDenied: true }),
    failureOf({ kind: "live" }, { ...calm, longestPauseMs: 1200 }),
    kNoWebGl,
    kNoWebAssembly,
    notLoaded(said, undefined),
    notLoaded(said, 1000),
    whyNoHeadset({ isSecure: false, hasWebXr: false, offers: false }),
    whyNoHeadset({ isSecure: true, hasWebXr: false, offers: false }),
    whyNoHeadset({ isSecure: true, hasWebXr: true, offers: false }),
  ];
  for (const found of failures) {
    assert.ok(found);
    const { title, text, actions, asks, retryAt } = found;
    assert.ok(title.length > 5 && title.length < 60 && !title.endsWith("."), title);
    assert.ok(text.length > 30 && text.endsWith("."), text);
    assert.ok(asks || actions.length > 0 || retryAt !== undefined, title);
  }
  const kinds = failures.map((found) => found?.kind);
  // Wrong version and wrong codec, and both ways to load files again, are the same to a person.
  assert.equal(new Set(kinds).size, kinds.length - 3, kinds.join(" "));
  assert.equal(failureOf({ kind: "live" }, calm), undefined);
  assert.equal(failureOf({ kind: "connecting" }, calm), undefined);
});

test("a lost server is told after a moment, with its time and the next attempt", () => {
  assert.equal(failureOf(lost, { ...calm, now: 4200 }), undefined);
  assert.equal(failure(lost, calm).wait, "No connection for 1 s. Trying again in 4 s.");
  assert.equal(failure(lost, { ...calm, now: 8999 }).wait, "No connection for 4 s. Trying again now.");
  assert.equal(failure(lost, { ...calm, now: 304_000 }).wait, "No connection for 5 min. Trying again now.");
  assert.equal(failure(lost, calm).title, "The connection is lost");
  assert.equal(failure(lost, { ...calm, hasJoined: false }).title, "The server cannot be reached");
  assert.match(failure(lost, { ...calm, networkDenied: true }).text, /allow access to the local network/);
});

test("after too many wrong codes the form waits for a minute", () => {
  const state = asking(ErrorCode.wrongPairingCode, "5 wrong pairing codes came from your address: try again in a minute");
  const locked = failure(state, calm);
  assert.deepEqual([locked.locked, locked.wait], [true, "You can try again in 59 s."]);
  const free = failure(state, { ...calm, now: 64_000 });
  assert.deepEqual([free.locked, free.asks, free.wait], [undefined, true, "You can try again now."]);
});

test("a full scene is tried again after ten seconds", () => {
  assert.equal(failure(refusal(ErrorCode.resourceExhausted), calm).retryAt, 14_000);
});

test("frames are late after several pauses or a long one, and in time again after five good seconds", () => {
  const at60 = 1000 / 60;
  const late = new LateFrames();
  for (const now of [0, 250, 500, 750]) late.sample(200, at60, now);
  assert.equal(late.longestMs(750), undefined, "pauses of 200 ms are not late");
  late.sample(300, at60, 1000);
  late.sample(400, at60, 1250);
  assert.equal(late.longestMs(1250), undefined, "two pauses are an accident");
  late.sample(260, at60, 1500);
  assert.equal(late.longestMs(1500), 400);
  for (let now = 1750; now < 6500; now += 250) late.sample(20, at60, now);
  assert.equal(late.longestMs(6400), 400);
  assert.equal(late.longestMs(6500), undefined);
  late.sample(1100, at60, 7000);
  assert.equal(late.longestMs(7000), 1100, "one long pause is enough");
  // Pauses are measured by the rate of the stream.
  const slow = new LateFrames();
  for (let now = 0; now < 5000; now += 250) slow.sample(500, 200, now);
  assert.equal(slow.longestMs(5000), undefined);
});

test("the longest pause includes the one that still lasts, and none across a restart", () => {
  const gaps = new FrameGaps();
  assert.equal(gaps.take(50), 0);
  gaps.arrived(100);
  gaps.arrived(116);
  gaps.arrived(300);
  assert.equal(gaps.take(310), 184);
  assert.equal(gaps.take(700), 400);
  gaps.arrived(720);
  assert.equal(gaps.take(721), 420);
  gaps.restart();
  assert.equal(gaps.take(5000), 0);
  gaps.arrived(5000);
  assert.equal(gaps.take(5010), 10);
});

test("the page says why there is no VR: first the page, then the browser, then the device", () => {
  const why = (isSecure: boolean, hasWebXr: boolean, offers: boolean) => whyNoHeadset({ isSecure, hasWebXr, offers })?.kind;
  assert.equal(why(true, true, true), undefined);
  assert.equal(why(false, true, false), "insecure");
  assert.equal(why(true, false, false), "no-webxr");
  assert.equal(why(true, true, false), "no-device");
  const steps = whyNoHeadset({ isSecure: false, hasWebXr: false, offers: false })?.steps?.join(" ") ?? "";
  for (const word of ["--tls self", "https", "QR code", "certificate", "fingerprint"]) assert.ok(steps.includes(word), word);
  const quest = "Mozilla/5.0 (X11; Linux x86_64; Quest 3) AppleWebKit/537.36 OculusBrowser/40.0 Chrome/136.0 VR Safari/537.36";
  assert.ok(isHeadsetBrowser(quest));
  assert.ok(!isHeadsetBrowser("Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 Chrome/142.0.0.0 Safari/537.36"));
});
