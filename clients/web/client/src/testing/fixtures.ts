// SPDX-License-Identifier: MIT
// Fixtures for vitest: servers that end with the test. Needs vitest 3.

import { playRecording, startServer, type PlayOptions, type Server, type ServerOptions } from "./server";

// The part of vitest's test context that the fixtures use.
interface TestContext {
  onTestFailed(done: () => void): void;
}
type Use<Value> = (value: Value) => Promise<void>;

export interface ClothstreamFixtures {
  // Plays a recording.
  play: (recording: string, options?: PlayOptions) => Promise<Server>;
  // Simulates scenes with these arguments of clothstream-server. Needs a Vulkan device.
  serve: (args: readonly string[], options?: ServerOptions) => Promise<Server>;
}

// Fixtures for `test.extend<ClothstreamFixtures>(clothstream)`. A server ends with its test; if the test has failed, its
// log is printed.
export const clothstream = {
  play: async ({ onTestFailed }: TestContext, use: Use<ClothstreamFixtures["play"]>): Promise<void> =>
    withServers(onTestFailed, (keep) => use(async (recording, options) => keep(await playRecording(recording, options)))),
  serve: async ({ onTestFailed }: TestContext, use: Use<ClothstreamFixtures["serve"]>): Promise<void> =>
    withServers(onTestFailed, (keep) => use(async (args, options) => keep(await startServer(args, options)))),
};

async function withServers(onTestFailed: TestContext["onTestFailed"], run: (keep: (server: Server) => Server) => Promise<void>): Promise<void> {
  const servers: Server[] = [];
  onTestFailed(() => {
    for (const server of servers) console.error(`Log of clothstream-server:\n${server.log}`);
  });
  await run((server) => {
    servers.push(server);
    return server;
  });
  const codes = await Promise.all(servers.map((server) => server.stop()));
  if (codes.some((code) => code !== 0)) throw new Error(`clothstream-server ended with ${codes.join(", ")}`);
}
