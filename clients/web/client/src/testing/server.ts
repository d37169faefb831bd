// SPDX-License-Identifier: MIT
// Starts clothstream-server as a child process.

import { spawn } from "node:child_process";
import { once } from "node:events";

const kStartMs = 60_000;
const kStopMs = 15_000;

export interface ServerOptions {
  // The program. Default: the environment variable CLOTHSTREAM_SERVER, else clothstream-server in PATH.
  program?: string;
  // Milliseconds until the server must have printed its addresses. Default 60,000.
  startMs?: number;
}

export interface Server {
  // Address of the stream, such as "ws://127.0.0.1:41234/stream".
  readonly url: string;
  // Address of the page, such as "http://127.0.0.1:41234/".
  readonly page: string;
  // Output of the program so far: standard output and standard error.
  readonly log: string;
  // Sends a signal, for example SIGKILL for a server that crashes.
  signal(name: NodeJS.Signals): void;
  // Ends the program with SIGTERM, and with SIGKILL if it still runs after `stopMs`, by default 15,000. Resolves to its
  // exit code, or to the name of the signal that ended it.
  stop(stopMs?: number): Promise<number | NodeJS.Signals>;
}

export interface PlayOptions extends ServerOptions {
  // The server sends the next frame when every client has acknowledged the last one, so that a client misses no frame.
  // Default true.
  lockstep?: boolean;
  // Recorded seconds per second, 0.1 to 8. Default: in lockstep as fast as clients acknowledge, else 1.
  speed?: number;
  // Clients that must be there before the first frame. Default 1.
  waitFor?: number;
  // Seed of dropped and delayed frames. Default: none.
  faults?: number;
  // Further arguments of clothstream-server.
  arguments?: readonly string[];
}

// Starts the program with these arguments on free ports of 127.0.0.1. Resolves when clients can connect. Rejects with the
// log if the program ends before, or prints no addresses in time.
export async function startServer(args: readonly string[], options: ServerOptions = {}): Promise<Server> {
  const program = options.program ?? (process.env["CLOTHSTREAM_SERVER"] || "clothstream-server");
  const child = spawn(program, ["--port", "0", "--grpc-port", "0", ...args], { stdio: ["ignore", "pipe", "pipe"] });
  const ended = new Promise<number | NodeJS.Signals>((resolve, reject) => {
    child.once("error", reject);
    child.once("close", (code, signal) => resolve(code ?? signal ?? 0));
  });
  let log = "";
  const kill = () => child.kill("SIGKILL");
  process.once("exit", kill);

  const stop = async (stopMs = kStopMs) => {
    const timer = setTimeout(kill, stopMs);
    child.kill("SIGTERM");
    const code = await ended;
    clearTimeout(timer);
    process.off("exit", kill);
    return code;
  };
  const page = new Promise<string>((resolve) => {
    for (const stream of [child.stdout, child.stderr]) {
      stream.setEncoding("utf8").on("data", (text: string) => {
        log += text;
        const found = /^page {4}(https?:\S+)\n(?:.*\n)*?gRPC /m.exec(log);
        if (found) resolve(found[1]!);
      });
    }
  });
  const late = new AbortController();
  const timer = setTimeout(() => late.abort(), options.startMs ?? kStartMs);
  const why = await Promise.race([
    page.then(() => undefined),
    ended.then((code) => `ended with ${code}`, (error: Error) => `cannot be started: ${error.message}`),
    once(late.signal, "abort").then(() => "printed no address in time"),
  ]);
  clearTimeout(timer);
  if (why !== undefined) {
    await stop(0).catch(() => undefined);
    throw new Error(`${program} ${why}; set CLOTHSTREAM_SERVER to the program. Its log:\n${log}`);
  }
  const address = await page;
  return {
    page: address,
    url: `${address.replace(/^http/, "ws")}stream`,
    get log() {
      return log;
    },
    signal: (name) => void child.kill(name),
    stop,
  };
}

// Plays a recording. Needs no Vulkan device.
export function playRecording(recording: string, options: PlayOptions = {}): Promise<Server> {
  const { lockstep = true, speed, waitFor = 1, faults } = options;
  const args = ["play", recording, "--wait-for", String(waitFor)];
  if (lockstep) args.push("--lockstep");
  if (speed !== undefined) args.push("--speed", String(speed));
  else if (lockstep) args.push("--speed", "max");
  if (faults !== undefined) args.push("--faults", String(faults));
  return startServer([...args, ...(options.arguments ?? [])], options);
}
