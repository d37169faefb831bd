// SPDX-License-Identifier: MIT
// @clothstream/client/testing: how it starts and ends the server. examples/testing has its usual use.
import { fileURLToPath } from "node:url";
import { playRecording } from "@clothstream/client/testing";
import { expect, test } from "vitest";

const recording = fileURLToPath(new URL("../cloth.mcap", import.meta.url));

test("shows the log of a program that does not start", async () => {
  await expect(playRecording("missing.mcap")).rejects.toThrow(/ended with 1; set CLOTHSTREAM_SERVER to the program. Its log:[^]*missing\.mcap/);
});

test("says what to set if there is no program", async () => {
  await expect(playRecording(recording, { program: "/nowhere/clothstream-server" })).rejects.toThrow("set CLOTHSTREAM_SERVER");
});

test("kills a server that does not end", async () => {
  const server = await playRecording(recording);
  server.signal("SIGSTOP");
  expect(await server.stop(100)).toBe("SIGKILL");
});
