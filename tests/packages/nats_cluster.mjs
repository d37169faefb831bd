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

// Writes a certificate for localhost, and accounts with one user, where pods have their Secrets.
async function writeSecrets(folder) {
  for (const name of ["tls", "accounts"]) await mkdir(join(folder, name), { recursive: true });
  const at = (name) => join(folder, "tls", name);
  const key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", at("tls.key")];
  const names = ["-subj", "/CN=nats", "-addext", "subjectAltName=DNS:localhost"];
  execFileSync("openssl", ["req", "-x509", "-days", "2", ...key, ...names, "-out", at("tls.crt")], { stdio: "ignore" });
  await cp(at("tls.crt"), at("ca.crt"));
  await writeFile(join(folder, "accounts/accounts.conf"), "authorization { user: tester, password: tester }\n");
}

// Starts the servers with this text of nats.conf, in which only addresses and paths change. Fails unless each gets routes to
// both others. Returns the INFO that the first one sends to its clients. Nothing runs afterwards.
export async function clusterGreeting(configuration, folder) {
  await writeSecrets(folder);
  const [clients, monitors, routes] = [await freePorts(), await freePorts(), await freePorts()];
  const processes = [];
  const start = async (i) => {
    let text = configuration
      .replaceAll("/etc/nats/", `${folder}/`)
      .replace("port: 4222", `host: 127.0.0.1\nport: ${clients[i]}`)
      .replace("http_port: 8222", `http: 127.0.0.1:${monitors[i]}`)
      .replace("port: 6222", `host: 127.0.0.1\n  port: ${routes[i]}`);
    for (const port of routes) text = text.replace(/tls:\/\/clothstream-nats-\d\.\S+/, `tls://localhost:${port}`);
    const file = join(folder, `config${i}`, "nats.conf");
    await mkdir(join(file, ".."));
    await writeFile(file, text);
    const environment = { ...process.env, POD_NAME: `nats-${i}` };
    const child = spawn("nats-server", ["--config", file], { env: environment, stdio: ["ignore", "ignore", "pipe"] });
    process.once("exit", () => child.kill("SIGKILL")); // whatever ends the test
    child.log = "";
    child.stderr.on("data", (data) => (child.log += data));
    processes.push(child);
  };
  const get = async (i, path) => (await fetch(`http://127.0.0.1:${monitors[i]}${path}`)).json();
  const until = async (what, check) => {
    for (const end = Date.now() + kTimeoutMs; !(await check().catch(() => false)); await sleep(50))
      assert.ok(Date.now() < end, `not within ${kTimeoutMs} ms: ${what}\n${processes.map(({ log }) => log).join("\n")}`);
  };

  try {
    for (const i of kServers) await start(i);
    const ids = [];
    for (const i of kServers) await until(`nats-${i} answers`, async () => (ids[i] = (await get(i, "/varz")).server_id) !== undefined);
    for (const i of kServers) {
      await until(`nats-${i} has routes to both others`, async () => {
        const found = (await get(i, "/routez")).routes.map((route) => route.remote_id);
        return ids.every((id, other) => other === i || found.includes(id));
      });
      assert.equal((await get(i, "/varz")).server_name, `nats-${i}`);
      assert.equal((await get(i, "/healthz")).status, "ok");
    }
    const socket = connect(clients[0], "127.0.0.1");
    const [greeting] = await new Promise((resolve) => socket.once("data", (...data) => resolve(data)));
    socket.destroy();
    return JSON.parse(String(greeting).slice("INFO ".length));
  } finally {
    for (const child of processes) child.kill("SIGKILL");
  }
}
