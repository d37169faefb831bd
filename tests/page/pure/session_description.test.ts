// SPDX-License-Identifier: MIT
// Descriptions of a data channel: what the browser's says, and how the server's reads.

import { assert, test } from "vitest";
import { describeServer, offerIn, type DatagramAnswer } from "../../../clients/web/client/src/session_description";
import { kBrowserDescription } from "./fake_peer";

const answer: DatagramAnswer = {
  ufrag: "srv1",
  password: "0123456789abcdefghij+/",
  fingerprint: Uint8Array.from({ length: 32 }, (_, index) => 8 * index),
  addresses: ["192.0.2.1", "2001:db8::1"],
  port: 8080,
};
const lines = describeServer(answer, kBrowserDescription).split("\r\n");

test("an offer has user name, password and fingerprint", () => {
  const offer = offerIn(kBrowserDescription);
  assert.equal(offer?.ufrag, "2rl4");
  assert.equal(offer?.password, "zgW3Um2rzsROYUKLk/JSr4rl");
  assert.deepEqual([...offer!.fingerprint], Array.from({ length: 32 }, (_, index) => index + 160));
});

test("attributes of the session count as well", () => {
  // Firefox has the fingerprint there.
  const fingerprint = /a=fingerprint.*\r\n/.exec(kBrowserDescription)![0];
  const moved = kBrowserDescription.replace(fingerprint, "").replace("t=0 0\r\n", `t=0 0\r\n${fingerprint.toLowerCase()}`);
  assert.deepEqual(offerIn(moved), offerIn(kBrowserDescription));
});

test("a description without one of them is no offer", () => {
  for (const name of ["ice-ufrag", "ice-pwd", "fingerprint"]) assert.isUndefined(offerIn(kBrowserDescription.replace(`a=${name}:`, "a=other:")));
  assert.isUndefined(offerIn(kBrowserDescription.replace("sha-256", "sha-512")));
  assert.isUndefined(offerIn(kBrowserDescription.replace("A0:A1:", "A0:")));
  assert.isUndefined(offerIn(kBrowserDescription.replace("A0:A1:", "A0:A1:A1:")));
  assert.isUndefined(offerIn(""));
});

test("the server is an ICE-lite agent that waits", () => {
  for (const line of ["a=ice-lite", "a=setup:passive", "a=sctp-port:5000", "a=max-message-size:1150", "a=ice-ufrag:srv1", "a=ice-pwd:0123456789abcdefghij+/"])
    assert.include(lines, line);
  assert.match(lines.find((line) => line.startsWith("a=fingerprint"))!, /^a=fingerprint:sha-256 00:08:10:(..:){28}F8$/);
  assert.equal(lines.at(-1), "", "the last line is complete");
});

test("the medium has the browser's name", () => {
  assert.include(lines, "a=mid:data");
  assert.include(lines, "a=group:BUNDLE data");
});

test("earlier addresses have higher priority", () => {
  const candidates = lines.filter((line) => line.startsWith("a=candidate"));
  assert.deepEqual(candidates, [
    "a=candidate:1 1 udp 2130706431 192.0.2.1 8080 typ host",
    "a=candidate:2 1 udp 2130706175 2001:db8::1 8080 typ host",
  ]);
});
