// SPDX-License-Identifier: MIT
// Clients of every language and platform join one scene of a server with TLS and tokens, and receive the same bits.
//
// Programs come from the environment: CLOTHSTREAM_SERVER, CLOTHSTREAM (command-line client), and TOGETHER, a JSON object
// from the name of each other client to its command. These commands get ADDRESS FINGERPRINT TOKEN_FILE NAME OUT and
// behave as follow.c. With CLOTHSTREAM_SCREENSHOTS, a picture of what each client has received is written there.

import assert from "node:assert/strict";
import { execFile, spawn } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { promisify } from "node:util";

import { launchBrowser, openPage } from "../page/browser.mjs";
import { startServer } from "../page/server.mjs";
import { drawClients } from "./picture.mjs";

const run = promisify(execFile);
const kServer = process.env.CLOTHSTREAM_SERVER;
const kClient = process.env.CLOTHSTREAM;
const kCommands = JSON.parse(process.env.TOGETHER);
const kScene = "flag";
const kMaxSceneBytes = 2 ** 26;
const kFrames = 20; // of each client, before the scene is paused
const kPatienceMs = 120_000;

let folder, server, fingerprint, token, browser;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-together-"));
  const key = join(folder, "keys", "key.pem");
  await run("mkdir", [join(folder, "keys")]);
  await run(kServer, ["token", "--new-key", key]);
  token = join(folder, "token");
  const { stdout } = await run(kServer, ["token", "--key", key, "--role", "owner", "--subject", "ada"]);
  await writeFile(token, stdout, { mode: 0o600 });
  // One quality: a client that is slow, as under QEMU, would otherwise get a coarser one, which has other bits.
  const scene = JSON.parse((await run(kServer, ["print-scene", kScene], { maxBuffer: kMaxSceneBytes })).stdout);
  const sceneFile = join(folder, "scene.json");
  await writeFile(sceneFile, JSON.stringify({ ...scene, stream: { ...scene.stream, qualities: 1 } }));
  const options = ["--scene-file", sceneFile, "--scene", kScene, "--tls", "self", "--state-dir", join(folder, "state"), "--token-keys", join(folder, "keys")];
  server = await startServer(0, options);
  [, fingerprint] = await server.line(/^key +([0-9a-fA-F:]+)/);
  browser = await launchBrowser();
});

after(async () => {
  await browser?.close();
  await server?.stop();
  await rm(folder, { recursive: true, force: true });
});

// A client that runs as a program. `frames` has the hash of each tick.
function follow(name, command, parse) {
  const child = spawn(command[0], command.slice(1), { stdio: ["ignore", "pipe", "pipe"] });
  process.once("exit", () => child.kill("SIGKILL"));
  const client = { name, frames: new Map(), errors: "", child };
  createInterface({ input: child.stdout }).on("line", (line) => {
    const frame = parse(line);
    if (frame) client.frames.set(frame.tick, frame.hash);
  });
  child.stderr.on("data", (text) => (client.errors += text));
  client.ended = new Promise((done) => child.once("close", (code) => done(code)));
  return client;
}

function readFrameLine(line) {
  const found = /^frame (\d+) ([0-9a-f]{16})\s*$/.exec(line);
  return found && { tick: Number(found[1]), hash: found[2] };
}

function readEventLine(line) {
  const { event, tick, hash } = JSON.parse(line);
  return event === "frame" ? { tick, hash } : undefined;
}

// Runs in the page: keeps the hash of each frame that the page has decoded.
function watchFrames(token) {
  window.localStorage.setItem("clothstream.token", token);
  const frames = (window.seenFrames = new Map());
  // 64-bit FNV-1a in two halves of 32 bits. The prime is 2^40 + 0x1b3.
  const hashOf = (positions) => {
    let high = 0xcbf29ce4;
    let low = 0x84222325;
    for (const byte of new Uint8Array(positions.buffer, positions.byteOffset, positions.byteLength)) {
      low = (low ^ byte) >>> 0;
      const product = low * 0x1b3;
      high = (Math.imul(high, 0x1b3) + Math.floor(product / 2 ** 32) + (low << 8)) >>> 0;
      low = product >>> 0;
    }
    return high.toString(16).padStart(8, "0") + low.toString(16).padStart(8, "0");
  };
  setInterval(() => {
    const page = window.clothstream;
    if (!page || !(page.statistics?.tick > 0) || frames.has(page.statistics.tick)) return;
    frames.set(page.statistics.tick, hashOf(page.positions));
  }, 5);
}

async function followInBrowser() {
  const context = await browser.newContext({ ignoreHTTPSErrors: true });
  await context.addInitScript(watchFrames, (await readFile(token, "utf8")).trim());
  const page = await openPage(context, `https://127.0.0.1:${server.port}/?name=Browser&scene=${kScene}`, { draws: false });
  const client = { name: "Chromium, TypeScript", frames: new Map(), page, context };
  client.update = async () => (client.frames = new Map(await page.evaluate(() => [...window.seenFrames])));
  return client;
}

async function until(what, check) {
  const end = Date.now() + kPatienceMs;
  while (!(await check())) {
    assert.ok(Date.now() < end, `${await what()} within ${kPatienceMs / 1000} s`);
    await new Promise((done) => setTimeout(done, 100));
  }
}

// Numbers of the lines of an OBJ file that start with a keyword: positions ("v"), or corners of triangles ("f").
function numbersOfObj(text, keyword) {
  const lines = text.split("\n").filter((line) => line.startsWith(`${keyword} `));
  return lines.flatMap((line) => line.split(" ").slice(1, 4).map((word) => parseFloat(word)));
}

function positionsOfFile(bytes) {
  return new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
}

test("every client receives the same bits", async (t) => {
  const grpc = (await server.line(/^gRPC +(?:https:\/\/)?(\S+)/))[1];
  const identity = ["--token", token, "--fingerprint", fingerprint];
  const obj = join(folder, "grpc.obj");
  const clients = [await followInBrowser()];
  const joined = ["join", `https://${grpc}`, ...identity, "--scene", kScene, "--name", "gRPC", "--events", "--frames", "--obj", obj];
  clients.push(follow("C++ over gRPC", [kClient, ...joined], readEventLine));
  for (const [name, command] of Object.entries(kCommands)) {
    const out = join(folder, `out-${clients.length}`);
    const all = [...command, `https://127.0.0.1:${server.port}`, fingerprint, token, name, out];
    clients.push(Object.assign(follow(name, all, readFrameLine), { out }));
  }
  const missing = () => clients.filter(({ frames }) => frames.size < kFrames);
  await until(
    () => `frames reach ${missing().map(({ name, errors }) => `${name} (${errors ?? ""})`).join(", ")}`,
    async () => {
      await clients[0].update();
      return missing().length === 0;
    },
  );

  await run(kClient, ["pause", kScene, "--server", `https://${grpc}`, ...identity]);
  for (const client of clients.filter(({ out }) => out)) assert.equal(await client.ended, 0, `${client.name}: ${client.errors}`);
  await clients[0].update();
  clients[1].child.kill("SIGTERM");
  assert.equal(await clients[1].ended, 0, clients[1].errors);

  // The last frame is that of the pause, and has reached everyone.
  const last = Math.max(...clients[0].frames.keys());
  const [reference, ...others] = clients;
  for (const { name, frames } of others) {
    const common = [...frames.keys()].filter((tick) => reference.frames.has(tick));
    assert.ok(common.includes(last), `${name} has the last tick, ${last}; its own is ${Math.max(...frames.keys())}`);
    assert.ok(common.length >= kFrames / 2, `${name} has ${common.length} ticks in common with the browser`);
    for (const tick of common) assert.equal(frames.get(tick), reference.frames.get(tick), `${name}, tick ${tick}`);
    t.diagnostic(`${name}: ${common.length} ticks equal`);
  }

  if (!process.env.CLOTHSTREAM_SCREENSHOTS) return;
  const { page } = clients[0];
  const positions = await page.evaluate(() => [...window.clothstream.positions]);
  const saved = await readFile(obj, "utf8");
  const triangles = numbersOfObj(saved, "f").map((corner) => corner - 1);
  const panels = [{ name: reference.name, positions, hash: reference.frames.get(last) }];
  for (const { name, frames, out } of others) {
    const received = out ? positionsOfFile(await readFile(out)) : numbersOfObj(saved, "v");
    panels.push({ name, positions: [...received], hash: frames.get(last) });
  }
  await drawClients(browser, { panels, triangles, tick: last }, join(process.env.CLOTHSTREAM_SCREENSHOTS, "together.png"));
});
