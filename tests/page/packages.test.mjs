// SPDX-License-Identifier: MIT
// The npm packages as others use them: installed from their tarballs, built by Vite and by webpack, and opened in a
// browser on a page of another origin without cross-origin isolation.

import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { cp, mkdir, mkdtemp, readdir, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { after, before, test } from "node:test";
import { kChromium, launchBrowser, openPage, takePixels } from "./browser.mjs";
import { writeHangingSheet } from "./scenes.mjs";
import { startServer } from "./server.mjs";

if (!existsSync(kChromium)) {
  console.log("skipped: chromium is not installed");
  process.exit(77);
}

const run = promisify(execFile);
const web = fileURLToPath(new URL("../../clients/web/", import.meta.url));
const require = createRequire(join(web, "package.json"));
const { version } = require("./client/package.json");
const tarball = (name) => join(process.env.CLOTHSTREAM_PACKAGES, `clothstream-${name}-${version}.tgz`);
const kViewport = { width: 400, height: 300 };
const kTypes = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };

let folder; // a project that uses the packages
let browser;
const servers = [];
const hosts = new Map(); // names of the builds and their HTTP servers

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-packages-"));
  await install();
  browser = await launchBrowser();
});

after(async () => {
  await browser?.close();
  for (const server of servers) await server.stop();
  for (const host of hosts.values()) await host.close();
  await rm(folder, { recursive: true });
});

// Installs the tarballs without a network. Everything else that the project needs is installed in the repository.
async function install() {
  await writeFile(join(folder, "package.json"), JSON.stringify({ type: "module" }));
  const options = ["--offline", "--legacy-peer-deps", "--ignore-scripts", "--no-audit", "--no-fund", "--cache", join(folder, "cache")];
  await run("npm", ["install", ...options, tarball("client"), tarball("three")], { cwd: folder });
  for (const name of ["three", "@types"]) await symlink(join(web, "node_modules", name), join(folder, "node_modules", name));
  for (const name of ["main.ts", "index.html"]) await cp(join(web, "example", name), join(folder, name));
}

// Serves a folder from an origin with this name. `headers` are sent with each file.
async function serve(name, root, headers = {}) {
  const http = createServer(async (request, response) => {
    const path = new URL(request.url, "http://localhost").pathname;
    const file = join(root, path === "/" ? "index.html" : path);
    try {
      const content = await readFile(file);
      response.writeHead(200, { "content-type": kTypes[extname(file)] ?? "text/plain", ...headers }).end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => http.listen(0, "127.0.0.1", done));
  hosts.set(name, { port: http.address().port, close: () => new Promise((done) => http.close(done) && http.closeAllConnections()) });
}

// Starts a server that admits the pages of all builds.
async function start(...options) {
  const origins = [...hosts.values()].flatMap(({ port }) => ["--allow-origin", `http://127.0.0.1:${port}`]);
  const server = await startServer(0, [...options, ...origins]);
  servers.push(server);
  return server;
}

// Opens the example on the server, and waits until it has joined.
async function open(host, server) {
  const page = await openPage(browser, `http://127.0.0.1:${host.port}/?server=ws://127.0.0.1:${server.port}/stream`, { viewport: kViewport });
  await page.waitForFunction(() => document.querySelector("output").textContent === "live").catch((error) => {
    throw new Error(`The example did not join. ${page.errors.join("\n")}`, { cause: error });
  });
  return page;
}

// Whether a pixel differs from the background, which is black.
const isCloth = (picture, x, y) => Math.max(...picture.colourAt(x, y)) > 30;

// Share of the pixels for which `differs(x, y)` is true.
function share(differs) {
  let count = 0;
  for (let y = 0; y < kViewport.height; ++y) for (let x = 0; x < kViewport.width; ++x) if (differs(x, y)) ++count;
  return count / (kViewport.width * kViewport.height);
}

// Takes pictures until one satisfies the condition.
async function pictureWhere(page, name, condition) {
  for (let tries = 0; tries < 100; ++tries) {
    const picture = await takePixels(page, name);
    if (condition(picture)) return picture;
  }
  throw new Error(`no picture ${name} has the expected content`);
}

test("the tarballs hold modules, types, readme and licences, and nothing else", async () => {
  const listed = { client: ["THIRD_PARTY_LICENSES.txt", "dist/worker.js", "dist/clothstream_core.wasm", "dist/clothstream_recording.wasm"], three: [] };
  for (const [name, more] of Object.entries(listed)) {
    const { stdout } = await run("tar", ["-tzf", tarball(name)]);
    const all = stdout.trim().split("\n").map((file) => file.replace("package/", ""));
    const isBundled = (file) => file.startsWith("node_modules/fzstd/");
    assert.equal(all.includes("node_modules/fzstd/package.json"), name === "client");
    const files = all.filter((file) => !isBundled(file));
    const sources = (await readdir(join(web, name, "src"), { recursive: true })).filter((file) => /(?<!\.d)\.ts$/.test(file));
    const expected = ["LICENSE", "README.md", "package.json", ...more];
    for (const source of sources) expected.push(...[".js", ".d.ts"].map((ending) => `dist/${source.replace(/\.ts$/, ending)}`));
    assert.deepEqual(new Set(files), new Set(expected));
  }
  const { stdout: licenses } = await run("tar", ["-xzOf", tarball("client"), "package/THIRD_PARTY_LICENSES.txt"]);
  for (const name of ["libc++", "wasi-libc", "protozero"]) assert.ok(licenses.includes(`=\n${name}`), name);
});

test("the example has at most 40 lines and uses only the public interface", async () => {
  const example = await readFile(join(web, "example/main.ts"), "utf8");
  assert.ok(example.trimEnd().split("\n").length <= 40);
  const imported = [...example.matchAll(/from "([^"]+)"/g)].map(([, name]) => name);
  assert.deepEqual(imported, ["three", "@clothstream/client", "@clothstream/three"]);
});

// Copies the programs of the readmes into the project, and returns their names.
async function copyPrograms() {
  const names = [];
  for (const name of ["client", "three"]) {
    const readme = await readFile(join(folder, "node_modules/@clothstream", name, "README.md"), "utf8");
    const [, program] = /```ts\n(.*?)```/s.exec(readme);
    names.push(`readme_${name}.ts`);
    await writeFile(join(folder, names.at(-1)), program);
  }
  return names;
}

test("the types of the packages suit the example and the readmes, however TypeScript finds them", async () => {
  const compilerOptions = {
    strict: true,
    exactOptionalPropertyTypes: true,
    target: "ES2022",
    lib: ["ES2022", "DOM", "DOM.Iterable"],
    types: [],
    module: "nodenext",
    outDir: "compiled",
  };
  await writeFile(join(folder, "tsconfig.json"), JSON.stringify({ compilerOptions, files: ["main.ts", ...(await copyPrograms())] }));
  for (const more of [[], ["--module", "esnext", "--moduleResolution", "bundler", "--skipLibCheck", "--noEmit"]])
    await run(process.execPath, [require.resolve("typescript/bin/tsc"), "-p", ".", ...more], { cwd: folder }).catch(({ stdout }) =>
      assert.fail(stdout),
    );
});

test("Vite builds the example", async () => {
  const { build } = await import(join(web, "node_modules/vite/dist/node/index.js"));
  await build({ root: folder, configFile: false, logLevel: "error", build: { outDir: "vite" } });
  await serve("Vite", join(folder, "vite"));
});

test("webpack builds the example", async () => {
  const output = join(folder, "webpack");
  await mkdir(output);
  const page = await readFile(join(folder, "index.html"), "utf8");
  await writeFile(join(output, "index.html"), page.replace("main.ts", "main.js"));
  const webpack = require("webpack");
  const compiler = webpack({ mode: "production", context: folder, entry: "./compiled/main.js", output: { path: output }, performance: false });
  const stats = await promisify(compiler.run.bind(compiler))();
  const { errors, warnings } = stats.toJson({ all: false, errors: true, warnings: true });
  assert.deepEqual([...errors, ...warnings], []);
  const policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'unsafe-inline'; connect-src 'self' ws://127.0.0.1:*";
  await serve("webpack", output, { "content-security-policy": policy });
});

test("Vite's development server finds the worker", async () => {
  const vite = await import(join(web, "node_modules/vite/dist/node/index.js"));
  const development = await vite.createServer({
    root: folder,
    configFile: false,
    logLevel: "error",
    server: { host: "127.0.0.1", port: 0 },
    optimizeDeps: { exclude: ["@clothstream/client"] },
  });
  await development.listen();
  hosts.set("development", { port: development.httpServer.address().port, close: () => development.close() });
});

test("each build draws moving cloth on a page of another origin that is not isolated", async (t) => {
  const server = await start("--scene", "swing");
  for (const [name, host] of hosts) {
    await t.test(name, async () => {
      const page = await open(host, server);
      assert.equal(await page.evaluate(() => window.crossOriginIsolated), false);
      const first = await pictureWhere(page, `package_${name}`, (picture) => share((x, y) => isCloth(picture, x, y)) > 0.05);
      await pictureWhere(page, `package_${name}_moved`, (picture) =>
        share((x, y) => isCloth(picture, x, y) !== isCloth(first, x, y)) > 0.01);
      assert.deepEqual(page.errors, []);
      await page.close();
    });
  }
});

test("the example takes hold of the cloth with the mouse", async () => {
  // The cloth hangs still, so that it is where the picture shows it.
  const page = await open(hosts.get("Vite"), await start("--scene-file", await writeHangingSheet(folder), "--scene", "hanging"));
  const picture = await pictureWhere(page, "package_before_grab", (taken) => share((x, y) => isCloth(taken, x, y)) > 0.05);
  const y = 200;
  let edge = kViewport.width - 1;
  while (!isCloth(picture, edge, y)) --edge;
  await page.mouse.move(edge - 10, y);
  await page.mouse.down();
  const target = { x: edge + 60, y: y - 10 };
  const steps = 30; // about 2 cm each
  for (let step = 1; step <= steps; ++step) {
    await page.mouse.move(edge - 10 + (70 * step) / steps, y - (10 * step) / steps);
    await page.evaluate(() => new Promise(requestAnimationFrame));
  }
  await pictureWhere(page, "package_grabbed", (taken) => isCloth(taken, target.x, target.y));
  await page.mouse.up();
  await pictureWhere(page, "package_released", (taken) => !isCloth(taken, target.x, target.y));
  await page.close();
});

test("the server refuses the page of an origin that it was not given", async () => {
  const { port } = hosts.get("Vite");
  const page = await openPage(browser, `http://localhost:${port}/?server=ws://127.0.0.1:${servers[0].port}/stream`, { viewport: kViewport });
  await page.waitForFunction(() => document.querySelector("output").textContent === "The server cannot be reached.");
  await page.close();
});
