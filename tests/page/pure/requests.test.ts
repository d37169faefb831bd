// SPDX-License-Identifier: MIT
// Requests to the server as promises, and proofs that a person types.

import { assert, test } from "vitest";
import type { Answer, Client, Session } from "@clothstream/client";
import { proofIn } from "../../../clients/web/page/src/identity";
import { Requests } from "../../../clients/web/page/src/panel/requests";

function answer(id: bigint, error = 0): Answer {
  return { id, error, errorText: error === 0 ? "" : "no such scene", name: "flag", bytes: 0, repairs: "" };
}

function start(kind = "live"): { requests: Requests; answers(given: Answer): void } {
  const client = { requests: {} } as Client;
  const session = { state: { kind }, client, flush: () => undefined } as Session;
  const requests = new Requests(() => session);
  return {
    requests,
    answers: (given) => requests.answered({ requests: { answer: () => given } } as unknown as Client),
  };
}

test("each request gets its own answer, in any order", async () => {
  const { requests, answers } = start();
  const [first, second] = [requests.ask(() => 1n), requests.ask(() => 2n)];
  answers(answer(2n, 5));
  answers(answer(9n));
  answers(answer(1n));
  assert.deepEqual(await first, { ok: true, answer: answer(1n) });
  assert.deepEqual(await second, { ok: false, error: "no such scene" });
});

test("a request that cannot be sent says why", async () => {
  const busy = await start().requests.ask(() => 0n);
  assert.isTrue(!busy.ok && busy.error.includes("still under way"));
  const apart = await start("reconnecting").requests.ask(() => assert.fail("sent"));
  assert.isTrue(!apart.ok && apart.error.includes("not connected"));
});

test("a lost connection ends all requests once", async () => {
  const { requests, answers } = start();
  const waiting = [requests.ask(() => 1n), requests.ask(() => 2n)];
  requests.lost();
  for (const outcome of await Promise.all(waiting)) assert.isTrue(!outcome.ok && outcome.lost);
  answers(answer(1n));
});

test("six digits are a pairing code, anything else is a token", () => {
  assert.deepEqual(proofIn(" 123 456\n"), { code: "123456" });
  for (const token of ["12345", "1234567", "12345a", "aaa.bbb.ccc"]) assert.deepEqual(proofIn(token), { token });
});
