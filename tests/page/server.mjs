// SPDX-License-Identifier: MIT
// Starts a clothstream-server on free ports.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";

const kStartMs = 60_000;
const kPollMs = 20;

for (const signal of ["SIGINT", "SIGTERM"]) process.once(signal, () => process.exit(1));

// Starts the program named by CLOTHSTREAM_SERVER. Resolves when it has printed the address of its page. Port 0 picks a
// free one.
export async function startServer(port = 0, more = ["--scene", "curtain"]) {
  const program = process.env.CLOTHSTREAM_SERVER;
  // The reconnect grace is shorter than the timeout of a test. Closed pages leave at once, unless a test asks for more.
  const options = ["--port", String(port), "--grpc-port", "0", "--hold", "30", ...more];
  if (!more.includes("--hold-page")) options.push("--hold-page", "0");
  // Prices depend on the speed of the machine.
  if (!more.includes("--max-load")) options.push("--max-load", "1000");
  const child = spawn(program, options, { stdio: ["ignore", "pipe", "pipe"] });
  // The server ends with the test, whatever ends the test.
  process.once("exit", () => child.kill("SIGKILL"));
  const output = [];
  const address = await new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`no address within ${kStartMs} ms\n${output.join("\n")}`)), kStartMs);
    const read = (line) => {
      output.push(line);
      const found = /https?:\/\/[^\s/]+:(\d+)/.exec(line);
      if (!found) return;
      clearTimeout(timer);
      resolve({ url: `http://127.0.0.1:${found[1]}/`, port: Number(found[1]) });
    };
    for (const stream of [child.stdout, child.stderr]) createInterface({ input: stream }).on("line", read);
    child.once("error", reject);
    child.once("exit", (code) => {
      clearTimeout(timer);
      reject(new Error(`${program} ended with ${code} before it served a page\n${output.join("\n")}`));
    });
  });
  // Explains the failure of a test whose server has ended.
  const complain = (code, signal) => console.error(`${program} ended with ${code ?? signal}\n${output.join("\n")}`);
  child.once("exit", complain);
  return {
    ...address,
    // Waits for a line of the output that matches, and returns the match.
    async line(pattern) {
      for (let waited = 0; waited < kStartMs; waited += kPollMs) {
        for (const text of output) if (pattern.test(text)) return pattern.exec(text);
        await new Promise((done) => setTimeout(done, kPollMs));
      }
      throw new Error(`no line ${pattern}\n${output.join("\n")}`);
    },
    async stop(signal = "SIGTERM") {
      child.off("exit", complain);
      if (child.exitCode !== null || child.signalCode !== null) return;
      child.kill(signal);
      await once(child, "exit");
    },
  };
}
