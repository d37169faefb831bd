// SPDX-License-Identifier: MIT
// The package for Unity, with mono in place of Unity: its C# follows a real server through the core that was compiled from
// its sources, with clang and libc++ as for Android. A stub takes the place of the engine.
//
// Environment: CLOTHSTREAM_SERVER, CLOTHSTREAM_PACKAGES (folder of the package), CLOTHSTREAM_UNITY_CORE (the compiled
// core), FOLLOW_C and CLOTHSTREAM_LIBRARY (a client in C, and the folder of its library).

import assert from "node:assert/strict";
import { execFile, execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { createServer } from "node:net";
import { mkdir, mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { startServer } from "../page/server.mjs";
import { assets } from "../../clients/unity/metas.mjs";

const { CLOTHSTREAM_SERVER, CLOTHSTREAM_PACKAGES, CLOTHSTREAM_UNITY_CORE, FOLLOW_C, CLOTHSTREAM_LIBRARY } = process.env;
for (const tool of ["mcs", "mono"]) {
  try {
    execFileSync("sh", ["-c", `command -v ${tool}`]);
  } catch {
    console.log(`skipped: ${tool} is not installed; ./dev test installs Debian's mono-mcs and mono-runtime`);
    process.exit(77);
  }
}

const run = promisify(execFile);
const here = fileURLToPath(new URL(".", import.meta.url));
const package_ = join(CLOTHSTREAM_PACKAGES, "com.clothstream.client");
const kSmall = ["--scene", "small", "--scene-file", join(here, "../e2e/small.json")];
// Unity accepts more, mono's compiler does not.
const kCompiler = ["-unsafe", "-debug", "-warnaserror", "-langversion:7"];

let folder;
let program, sceneProgram, bodyProgram;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-unity-"));
  const core = await compile("ClothStream.Core.dll", [join(package_, "Runtime/Core")]);
  program = await compile("Program.exe", [here], [`-r:${core}`]);
  const engine = await compile("UnityEngine.dll", [join(here, "engine")]);
  const references = [`-r:${core}`, `-r:${engine}`];
  const components = join(package_, "Runtime/Unity");
  // Without com.unity.xr.hands, and as in a build without checks.
  await compile("WithoutHands.dll", [components], references);
  const unity = await compile("ClothStream.Unity.dll", [components], [...references, "-define:CLOTHSTREAM_XR_HANDS", "-define:ENABLE_UNITY_COLLECTIONS_CHECKS"]);
  bodyProgram = await compile("BodyProgram.exe", [join(here, "bodies")], [...references, `-r:${unity}`]);
  sceneProgram = await compile("SceneProgram.exe", [join(here, "scene"), join(package_, "Samples~/ClothInARoom")], [...references, `-r:${unity}`]);
});

after(() => rm(folder, { recursive: true }));

// Compiles all C# of folders, and returns the path of the result.
async function compile(name, folders, options = []) {
  const found = await Promise.all(folders.map(async (from) => (await readdir(from)).filter((file) => file.endsWith(".cs")).map((file) => join(from, file))));
  const out = join(folder, name);
  await run("mcs", [...kCompiler, ...(name.endsWith(".dll") ? ["-target:library"] : []), ...options, `-out:${out}`, ...found.flat()]);
  return out;
}

const environment = { ...process.env, LD_LIBRARY_PATH: `${dirname(CLOTHSTREAM_UNITY_CORE)}:${CLOTHSTREAM_LIBRARY}`, MONO_PATH: "" };
const mono = (file, ...args) => run("mono", ["--debug", file, ...args], { env: environment });

// Hash of each frame that a client has printed, by tick.
const frames = (output) => new Map([...output.matchAll(/^frame (\d+) (\w+)$/gm)].map(([, tick, hash]) => [tick, hash]));

// Runs `use` with the address of a new server.
async function withServer(options, use) {
  const server = await startServer(0, options);
  try {
    return await use(`127.0.0.1:${server.port}`, server);
  } finally {
    await server.stop();
  }
}

test("each asset of the package has a .meta file with a GUID that no other has", async () => {
  const found = assets(package_);
  assert.ok(found.some(({ path }) => path === "Runtime/Plugins/Android/ClothStreamCore.androidlib"));
  const guids = await Promise.all(
    found.map(async ({ path }) => /^guid: ([0-9a-f]{32})$/m.exec(await readFile(join(package_, `${path}.meta`), "utf8"))[1]),
  );
  assert.equal(new Set(guids).size, found.length);
});

test("the package brings the licences of the sources that it contains", async () => {
  const others = (await readdir(join(package_, "Runtime/Plugins/Android/ClothStreamCore.androidlib/cpp"))).filter((name) => !/^(clients|proto|clothstream_core\.cpp)$/.test(name));
  assert.deepEqual(others.sort(), ["protozero", "simde", "tl"]);
  const notices = await readFile(join(package_, "Third Party Notices.md"), "utf8");
  for (const work of ["protozero", "tl::expected", "SIMDe"]) assert.match(notices, new RegExp(`^# ${work}$`, "m"));
});

test("addresses, fingerprints and options are checked", async () => {
  await mono(program, "parts", "-");
});

test("frames are those of a client in C, bit for bit", () =>
  withServer(kSmall, async (address) => {
    const sharp = spawn("mono", ["--debug", program, "follow", address], { env: environment, stdio: ["pipe", "pipe", "inherit"] });
    const lines = createInterface({ input: sharp.stdout });
    const printed = [];
    lines.on("line", (line) => printed.push(line));
    await Promise.race([once(lines, "line"), once(lines, "close")]);
    const c = await run(FOLLOW_C, [address], { env: environment });
    sharp.stdin.end();
    const [code] = await once(sharp, "close");
    assert.equal(code, 0);
    const [own, other] = [frames(printed.join("\n")), frames(c.stdout)];
    const both = [...own.keys()].filter((tick) => other.has(tick));
    console.log(`${both.length} frames of both clients`);
    assert.ok(both.length >= 20);
    for (const tick of both) assert.equal(own.get(tick), other.get(tick), `tick ${tick}`);
  }));

test("hands, grabs and parameters reach the server and other participants", () => withServer(kSmall, (address) => mono(program, "input", address)));

test("a client returns after its server was killed and started again", async () => {
  const first = await startServer(0, kSmall);
  const child = spawn("mono", ["--debug", program, "return", `127.0.0.1:${first.port}`], { env: environment });
  const lines = [];
  let second;
  try {
    for await (const line of createInterface({ input: child.stdout })) {
      lines.push(line);
      if (line === "joined") await first.stop("SIGKILL");
      if (line.startsWith("lost: ")) second = await startServer(first.port, kSmall);
    }
    if (child.exitCode === null) await once(child, "exit");
  } finally {
    child.kill();
    await first.stop();
    await second?.stop();
  }
  assert.equal(child.exitCode, 0, lines.join("\n"));
  assert.equal(lines.at(-1), "returned");
});

test("with TLS the key of the server and the token are checked", async () => {
  const keys = join(folder, "keys");
  await mkdir(keys, { mode: 0o700 });
  await run(CLOTHSTREAM_SERVER, ["token", "--new-key", join(keys, "key.pem")]);
  const { stdout: token } = await run(CLOTHSTREAM_SERVER, ["token", "--key", join(keys, "key.pem"), "--subject", "unity"]);
  const secure = ["--tls", "self", "--state-dir", join(folder, "state"), "--token-keys", keys];
  await withServer([...kSmall, ...secure], async (plain, server) => {
    const address = `wss://${plain}`;
    const [, key] = await server.line(/\b((?:[0-9A-F]{2}:){31}[0-9A-F]{2})\b/);
    await mono(program, "secure", address, key, token.trim());
    const wrong = key.replaceAll("0", "1").replaceAll("2", "3");
    const refused = async (fingerprint, proof) => (await mono(program, "refused", address, fingerprint, proof)).stdout;
    assert.match(await refused(wrong, token.trim()), new RegExp(`^refused 0: .* has the fingerprint ${key}`));
    assert.match(await refused("", token.trim()), new RegExp(`^refused 0: .*no known authority.* ${key}`));
    assert.match(await refused(key, ""), /^refused 60: /);
  });
});

// Returns what a client says of a program that answers with these bytes and then ends the connection.
async function problemWith(answer) {
  const server = createServer((socket) => {
    socket.on("error", () => {});
    socket.once("data", () => socket.end(answer));
  });
  server.listen(0, "127.0.0.1");
  await once(server, "listening");
  try {
    return (await mono(program, "problem", `127.0.0.1:${server.address().port}`)).stdout;
  } finally {
    server.close();
  }
}

test("answers of other programs are refused with a reason", async () => {
  assert.match(await problemWith("220 mail.example.org ESMTP\r\n\r\n"), /another program answers, not a clothstream-server/);
  assert.match(await problemWith("HTTP/1.1 404 Not Found\r\n\r\n"), /HTTP status 404 \(Not Found\)\.$/m);
  assert.match(await problemWith("HTTP/1.1 403 Forbidden\r\nContent-Length: 2000000000\r\n\r\nthe scene\x07 is full\r\nmore"), /HTTP status 403 \(the scene is full\)\.$/m);
  assert.match(await problemWith("HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: AAAA\r\n\r\n"), /does not answer as a WebSocket/);
  assert.match(await problemWith(`HTTP/1.1 200 OK\r\n${"X: y\r\n".repeat(2000)}`), /header of more than 8 KiB/);
  assert.match(await problemWith("HTTP/1.1 1"), /ended the connection before its answer/);
});

test("components draw cloth, send hands and controllers, grab, and report errors", () => withServer(kSmall, (address) => mono(sceneProgram, address)));

test("a body of the scene follows head, hands and controllers, and is drawn from the neck down for its wearer", () =>
  withServer(["--scene", "walker"], (address) => mono(bodyProgram, address)));

test("a connection pairs, and joins with the token that it got", () =>
  withServer([...kSmall, "--pairing", "--state-dir", join(folder, "pairing")], async (address, server) => {
    const [, code] = await server.line(/^pair +(\d{6})/);
    await mono(sceneProgram, address, code);
  }));
