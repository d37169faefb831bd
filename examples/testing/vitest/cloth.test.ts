// SPDX-License-Identifier: MIT
// Plays a recording to a program that uses @clothstream/client, and compares what the program makes of each frame with
// what is committed. UPDATE_EXPECTED=1 writes what is compared.
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { clothstream, frames, type ClothstreamFixtures, type SocketConstructor } from "@clothstream/client/testing";
import { expect, test as base } from "vitest";
import { WebSocket } from "ws";

const test = base.extend<ClothstreamFixtures>(clothstream);
const path = (name: string) => fileURLToPath(new URL(`../${name}`, import.meta.url));

// The program under test: describes each frame in a line.
async function describeFrames(url: string): Promise<string> {
  let lines = "";
  for await (const { tick, hash, positions } of frames(url, { WebSocket: WebSocket as unknown as SocketConstructor })) {
    let lowest = positions[1]!;
    for (let i = 1; i < positions.length; i += 3) lowest = Math.min(lowest, positions[i]!);
    lines += `${tick} ${hash} ${Number(lowest.toPrecision(9))}\n`;
  }
  return lines;
}

test("every frame is the same", async ({ play }) => {
  const server = await play(path("cloth.mcap"));
  const lines = await describeFrames(server.url);
  if (process.env["UPDATE_EXPECTED"]) writeFileSync(path("cloth.frames"), lines);
  expect(lines).toBe(readFileSync(path("cloth.frames"), "utf8"));
});

test("the same faults give the same frames", async ({ play }) => {
  const once = await describeFrames((await play(path("cloth.mcap"), { faults: 4 })).url);
  const again = await describeFrames((await play(path("cloth.mcap"), { faults: 4 })).url);
  expect(again).toBe(once);
  expect(once.length).toBeLessThan(readFileSync(path("cloth.frames"), "utf8").length);
});
