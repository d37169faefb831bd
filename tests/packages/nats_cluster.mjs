// SPDX-License-Identifier: MIT
// Runs three NATS servers on this machine with the configuration that pods have.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { cp, mkdir, writeFile } from "node:fs/promises";
import { connect, createServer } from "node:net";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

const kTimeoutMs = 30_000;
const kServers = [0, 1, 2];

async function freePorts() {
  const listeners = kServers.map(() => createServer());
  for (const listener of listeners) await new Promise((resolve) => listener.listen(0, "127.0.0.1", resolve));
  const ports = listeners.map((listener) => listener.address().port);
  for (const listener of listeners) await new Promise((resolve) => listener.close(resolve));
  return ports;
}

// Waits until a check returns true; until then it may also fail.
export async function until(what, check, details = () => "") {
  for (const end = Date.now() + kTimeoutMs; !(await check().catch(() => false)); await sleep(50))
    assert.ok(Date.now() < end, `not within ${kTimeoutMs} ms: ${what}\n${details()}`);
}

// Starts a program that ends with the test. Its output is in `log`.
export function startProcess(program, args, environment = process.env) {
  const child = spawn(program, args, { env: environment, stdio: ["ignore", "pipe", "pipe"] });
  process.once("exit", () => child.kill("SIGKILL")); // whatever ends the test
  child.log = "";
  for (const output of [child.stdout, child.stderr]) output.on("data", (data) => (child.log += data));
  return child;
}

// Writes a certificate for localhost, and accounts.conf, where pods have their Secrets.
async function writeSecrets(folder, accounts) {
  for (const name of ["tls", "accounts"]) await mkdir(join(folder, name), { recursive: true });
  const at = (name) => join(folder, "tls", name);
  const key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", at("tls.key")];
  const names = ["-subj", "/CN=nats", "-addext", "subjectAltName=DNS:localhost"];
  execFileSync("openssl", ["req", "-x509", "-days", "2", ...key, ...names, "-out", at("tls.crt")], { stdio: "ignore" });
  await cp(at("tls.crt"), at("ca.crt"));
  await writeFile(join(folder, "accounts/accounts.conf"), accounts);
}

// Starts the servers with this text of nats.conf, in which only addresses and paths change. Fails unless each gets routes to
// both others, and is healthy. Then calls `use` with the URLs for clients, the file of the authority, the INFO that the first
// server sends to its clients, a function that asks a monitoring port, and one that returns the logs. Ends the servers.
export async function withCluster(configuration, accounts, folder, use) {
  await writeSecrets(folder, accounts);
  const [clients, monitors, routes] = [await freePorts(), await freePorts(), await freePorts()];
  const start = async (i) => {
    let text = configuration
      .replaceAll("/etc/nats/", `${folder}/`)
      .replace(/^( *store_dir:) \S+$/m, `$1 ${folder}/store${i}`)
      .replace("port: 4222", `host: 127.0.0.1\nport: ${clients[i]}`)
      .replace("http_port: 8222", `http: 127.0.0.1:${monitors[i]}`)
      .replace("port: 6222", `host: 127.0.0.1\n  port: ${routes[i]}`);
    for (const port of routes) text = text.replace(/tls:\/\/clothstream-nats-\d\.\S+/, `tls://localhost:${port}`);
    const file = join(folder, `config${i}`, "nats.conf");
    await mkdir(join(file, ".."));
    await writeFile(file, text);
    return startProcess("nats-server", ["--config", file], { ...process.env, POD_NAME: `nats-${i}` });
  };
  const get = async (i, path) => (await fetch(`http://127.0.0.1:${monitors[i]}${path}`)).json();

  const processes = [];
  const log = () => processes.map((child) => child.log).join("\n");
  try {
    for (const i of kServers) processes.push(await start(i));
    const ids = [];
    for (const i of kServers) await until(`nats-${i} answers`, async () => (ids[i] = (await get(i, "/varz")).server_id) !== undefined, log);
    for (const i of kServers) {
      const hasRoutes = async () => {
        const found = (await get(i, "/routez")).routes.map((route) => route.remote_id);
        return ids.every((id, other) => other === i || found.includes(id));
      };
      await until(`nats-${i} has routes to both others`, hasRoutes, log);
      assert.equal((await get(i, "/varz")).server_name, `nats-${i}`);
      await until(`nats-${i} is healthy`, async () => (await get(i, "/healthz")).status === "ok", log);
    }
    const socket = connect(clients[0], "127.0.0.1");
    const [greeting] = await new Promise((resolve) => socket.once("data", (...data) => resolve(data)));
    socket.destroy();
    await use({
      greeting: JSON.parse(String(greeting).slice("INFO ".length)),
      urls: clients.map((port) => `tls://localhost:${port}`),
      authority: join(folder, "tls/ca.crt"),
      get,
      log,
    });
  } finally {
    for (const child of processes) child.kill("SIGKILL");
  }
}
