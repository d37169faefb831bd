// SPDX-License-Identifier: MIT
// A clothstream-server of the test's own, on ports that are free.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";

const kStartMs = 60_000;

for (const signal of ["SIGINT", "SIGTERM"]) process.once(signal, () => process.exit(1));

// Starts the program named by CLOTHSTREAM_SERVER; resolves once it has said where its page is. `port` 0: any.
export async function startServer(port = 0, more = ["--scene", "curtain"]) {
  const program = process.env.CLOTHSTREAM_SERVER;
  // Whoever goes without being heard is held for less than a test waits for anything.
  const options = ["--port", String(port), "--grpc-port", "0", "--hold", "30", ...more];
  const child = spawn(program, options, { stdio: ["ignore", "pipe", "pipe"] });
  // Whatever ends the test, the server does not outlive it.
  process.once("exit", () => child.kill("SIGKILL"));
  const said = [];
  const address = await new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`no address within ${kStartMs} ms\n${said.join("\n")}`)), kStartMs);
    const read = (line) => {
      said.push(line);
      const found = /http:\/\/[^\s/]+:(\d+)/.exec(line);
      if (!found) return;
      clearTimeout(timer);
      resolve({ url: `http://127.0.0.1:${found[1]}/`, port: Number(found[1]) });
    };
    for (const stream of [child.stdout, child.stderr]) createInterface({ input: stream }).on("line", read);
    child.once("error", reject);
    child.once("exit", (code) => {
      clearTimeout(timer);
      reject(new Error(`${program} ended with ${code} before it served a page\n${said.join("\n")}`));
    });
  });
  // So that a test that fails for want of a server says so.
  const complain = (code, signal) => console.error(`${program} ended with ${code ?? signal}\n${said.join("\n")}`);
  child.once("exit", complain);
  return {
    ...address,
    async stop() {
      child.off("exit", complain);
      if (child.exitCode !== null || child.signalCode !== null) return;
      child.kill("SIGTERM");
      await once(child, "exit");
    },
  };
}
