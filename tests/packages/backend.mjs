// SPDX-License-Identifier: MIT
// Runs deploy/backend with a stand-in for the Kubernetes API. The stand-in allocates game servers as Agones documents it for
// GameServerAllocation (allocation.agones.dev/v1 of Agones 1.41): ordered selectors, priorities, states, counters and lists.

import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { createHmac, createPublicKey, randomBytes, verify } from "node:crypto";
import { once } from "node:events";
import { existsSync, readFileSync } from "node:fs";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:https";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, beforeEach, test } from "node:test";
import { fileURLToPath } from "node:url";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
const source = fileURLToPath(new URL("../../deploy/backend/", import.meta.url));
function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(kSkipped);
}
if (!existsSync(join(source, "node_modules/jose"))) skip(`${source}node_modules is missing; the build installs it (ninja test_backend)`);
if (spawnSync("openssl", ["version"]).status !== 0) skip("there is no openssl (apt install openssl)");

const kAccountToken = "token-of-the-account";
const kApiKey = "0123456789abcdef0123456789abcdef";
const kSecret = randomBytes(32);
let folder, api, backend;
const at = (name) => join(folder, name);

// Game servers and the endpoint that allocates them.
class Cluster {
  servers = [];
  calls = [];
  answer = null; // instead of an allocation: a status, or "silence"

  constructor(key, cert) {
    this.listener = createServer({ key, cert }, async (request, response) => {
      let text = "";
      for await (const chunk of request) text += chunk;
      this.calls.push(JSON.parse(text));
      if (this.answer === "silence") return;
      const isAllowed = request.headers.authorization === `Bearer ${kAccountToken}`;
      const path = "/apis/allocation.agones.dev/v1/namespaces/cloth/gameserverallocations";
      const isKnown = request.method === "POST" && request.url === path && request.headers["content-type"] === "application/json";
      const status = this.answer ?? (isAllowed ? (isKnown ? 201 : 404) : 401);
      const body = status === 201 ? { ...this.calls.at(-1), status: this.allocate(this.calls.at(-1)) } : { kind: "Status", code: status };
      response.writeHead(status, { "content-type": "application/json" }).end(JSON.stringify(body));
    });
  }

  allocate({ apiVersion, kind, spec }) {
    assert.deepEqual([apiVersion, kind], ["allocation.agones.dev/v1", "GameServerAllocation"]);
    assert.deepEqual(Object.keys(spec).sort(), ["priorities", "scheduling", "selectors"]);
    assert.equal(spec.scheduling, "Packed");
    const free = (server, name) => server.counters[name].capacity - server.counters[name].count;
    const sorted = [...this.servers].sort((a, b) => {
      for (const { type, key, order } of spec.priorities) {
        assert.equal(type, "Counter");
        const difference = free(a, key) - free(b, key);
        if (difference !== 0) return order === "Descending" ? -difference : difference;
      }
      return 0;
    });
    for (const { matchLabels, gameServerState = "Ready", counters = {}, lists = {}, ...rest } of spec.selectors) {
      assert.deepEqual(rest, {});
      const found = sorted.find(
        (server) =>
          Object.entries(matchLabels).every(([name, value]) => server.labels[name] === value) &&
          server.state === gameServerState &&
          Object.entries(counters).every(([name, { minAvailable }]) => free(server, name) >= minAvailable) &&
          Object.entries(lists).every(([name, { containsValue }]) => server.lists[name].includes(containsValue)),
      );
      if (!found) continue;
      found.state = "Allocated";
      const ports = [{ name: "web", port: found.port }];
      return { state: "Allocated", gameServerName: found.name, nodeName: `node-of-${found.name}`, address: "192.0.2.7", ports };
    }
    return { state: "UnAllocated", gameServerName: "" };
  }
}

let lastPort = 7000;
const gameServer = (name, state, scenes, fleet = "clothstream-server") => ({
  name,
  state,
  port: ++lastPort,
  labels: { "agones.dev/fleet": fleet },
  counters: { "created-scenes": { count: scenes.length, capacity: 3 } },
  lists: { scenes: ["veil", ...scenes] },
});

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-backend-"));
  const key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", at("tls.key")];
  const name = ["-subj", "/CN=kubernetes", "-addext", "subjectAltName=IP:127.0.0.1"];
  execFileSync("openssl", ["req", "-x509", "-days", "2", ...key, ...name, "-out", at("ca.crt")], { stdio: "ignore" });
  execFileSync("openssl", ["ecparam", "-name", "prime256v1", "-genkey", "-noout", "-out", at("2026-11.pem")]);
  execFileSync("openssl", ["ecparam", "-name", "secp384r1", "-genkey", "-noout", "-out", at("other.pem")]);
  await writeFile(at("token"), `${kAccountToken}\n`);
  await writeFile(at("api-key"), `${kApiKey}\n`);
  await writeFile(at("secret"), `whsec_${kSecret.toString("base64")}\n`);
  api = new Cluster(readFileSync(at("tls.key")), readFileSync(at("ca.crt")));
  api.listener.listen(0, "127.0.0.1");
  await once(api.listener, "listening");
  backend = await start();
});
after(async () => {
  backend?.process.kill("SIGKILL");
  api?.listener.closeAllConnections();
  api?.listener.close();
  await rm(folder, { recursive: true, force: true });
});
beforeEach(() => Object.assign(api, { servers: [], calls: [], answer: null }));

function run(options) {
  const args = Object.entries(options).map(([name, value]) => `--${name}=${value}`);
  const child = spawn(process.execPath, [join(source, "backend.mjs"), ...args], { stdio: ["ignore", "pipe", "pipe"] });
  process.once("exit", () => child.kill("SIGKILL")); // whatever ends the test
  child.log = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (data) => (child.log += data));
  return child;
}

async function start() {
  const child = run({
    port: 0,
    key: at("2026-11.pem"),
    "api-key": at("api-key"),
    "events-secret": at("secret"),
    account: folder,
    kubernetes: `https://127.0.0.1:${api.listener.address().port}`,
    namespace: "cloth",
    address: "https://{node}.nodes.example.org:{port}",
  });
  while (!/listening on port \d+/.test(child.log)) {
    const [what] = await Promise.race([once(child.stdout, "data"), once(child, "exit").then(() => ["exit"])]);
    assert.notEqual(what, "exit", child.log);
  }
  return { process: child, url: `http://127.0.0.1:${/listening on port (\d+)/.exec(child.log)[1]}` };
}

async function send(method, path, body, headers = { authorization: `Bearer ${kApiKey}` }) {
  const text = typeof body === "object" ? JSON.stringify(body) : body;
  const response = await fetch(backend.url + path, { method, body: text, headers, signal: AbortSignal.timeout(20_000) });
  const answer = await response.text();
  return { status: response.status, value: answer && JSON.parse(answer) };
}

const ada = { scene: "mine", tenant: "studio", subject: "ada@example.org" };
const ask = (more, headers) => send("POST", "/scenes", { ...ada, ...more }, headers);
const decode = (token) => token.split(".").map((part) => Buffer.from(part, "base64url"));

test("a token has the claims of its request, and the signature of the key", async () => {
  api.servers = [gameServer("a", "Ready", [])];
  const earliest = Math.floor(Date.now() / 1000) + 28_800;
  const { status, value } = await ask({ scene: "claims", name: "Ada", role: "viewer" });
  assert.equal(status, 200, JSON.stringify(value));
  assert.deepEqual(value, {
    server: { name: "a", address: `https://node-of-a.nodes.example.org:${api.servers[0].port}` },
    scene: "claims",
    token: value.token,
  });
  const [header, claims, signature] = decode(value.token);
  assert.deepEqual(JSON.parse(header), { alg: "ES256", kid: "2026-11" });
  const { exp, ...rest } = JSON.parse(claims);
  assert.deepEqual(rest, { role: "viewer", scene: "claims", name: "Ada", sub: ada.subject, tenant: "studio", aud: "clothstream" });
  assert.ok(Number.isInteger(exp) && exp >= earliest && exp <= earliest + 60);
  const key = { key: createPublicKey(readFileSync(at("2026-11.pem"))), dsaEncoding: "ieee-p1363" };
  assert.ok(verify("sha256", Buffer.from(value.token.replace(/\.[^.]*$/, "")), key, signature));
});

test("the token of an owner is for all scenes, because only such a token creates a scene", async () => {
  api.servers = [gameServer("a", "Ready", [])];
  const claimsOf = async (role) => JSON.parse(decode((await ask({ role })).value.token)[1]);
  assert.equal((await claimsOf("owner")).scene, undefined);
  assert.equal((await claimsOf("owner")).role, "owner");
  assert.equal((await claimsOf("participant")).scene, "mine");
  assert.equal((await claimsOf(undefined)).role, "participant");
});

const server = process.env.CLOTHSTREAM_SERVER;
test("clothstream-server makes the same token", { skip: server ? false : "CLOTHSTREAM_SERVER is not set" }, async () => {
  api.servers = [gameServer("a", "Ready", [])];
  const { value } = await ask({ scene: "same", name: "Ada", role: "viewer" });
  const options = { key: at("2026-11.pem"), role: "viewer", scene: "same", name: "Ada", subject: ada.subject, tenant: "studio", valid: "8h" };
  const args = Object.entries(options).flatMap(([name, text]) => [`--${name}`, text]);
  const theirs = decode(execFileSync(server, ["token", ...args], { encoding: "utf8", env: {} }).trim()).slice(0, 2);
  const [{ typ, ...header }, { exp, ...claims }] = theirs.map((part) => JSON.parse(part));
  const [ownHeader, { exp: ownExp, ...ownClaims }] = decode(value.token)
    .slice(0, 2)
    .map((part) => JSON.parse(part));
  assert.deepEqual([ownHeader, ownClaims], [header, claims]);
  assert.ok(typ === undefined || typ === "JWT");
  assert.ok(Math.abs(exp - ownExp) <= 60);
});

test("a scene goes to the server that has it, else to the fullest with room, else to an unused one", async () => {
  api.servers = [
    gameServer("unused", "Ready", []),
    gameServer("emptier", "Allocated", ["one"]),
    gameServer("fuller", "Allocated", ["two", "three"]),
    gameServer("full", "Allocated", ["four", "five", "six"]),
    gameServer("foreign", "Allocated", ["seven", "eight"], "another-fleet"),
  ];
  const serverOf = async (scene) => (await ask({ scene })).value.server.name;
  assert.equal(await serverOf("five"), "full");
  assert.equal(await serverOf("one"), "emptier");
  assert.equal(await serverOf("new-1"), "fuller");
  api.servers = api.servers.filter(({ name }) => !["emptier", "fuller"].includes(name));
  assert.equal(await serverOf("new-2"), "unused");
  assert.equal(api.servers[0].state, "Allocated");
});

test("requests for the same new scene get the same server from one allocation", async () => {
  api.servers = [gameServer("a", "Ready", []), gameServer("b", "Ready", [])];
  const answers = await Promise.all(["owner", "participant", "viewer"].map((role) => ask({ scene: "shared", role })));
  assert.deepEqual(
    answers.map(({ value }) => value.server.name),
    ["a", "a", "a"],
  );
  assert.equal(api.calls.length, 1);
});

test("without a server the answer is 503, and the next request tries again", async () => {
  api.servers = [gameServer("full", "Allocated", ["one", "two", "three"])];
  const { status, value } = await ask({ scene: "waits" });
  assert.deepEqual([status, value], [503, { error: "no server has room (UnAllocated); try again later" }]);
  for (const answer of [409, 429, 500]) {
    api.answer = answer;
    assert.equal((await ask({ scene: "waits" })).status, 503);
  }
  api.answer = 403; // the account lacks the right: trying again does not help
  assert.equal((await ask({ scene: "waits" })).status, 502);
  Object.assign(api, { answer: null, servers: [gameServer("a", "Ready", [])] });
  assert.equal((await ask({ scene: "waits" })).status, 200);
});

test("a Kubernetes API that does not answer is given up after five seconds", async () => {
  api.answer = "silence";
  const { status, value } = await ask({ scene: "silent" });
  assert.equal(status, 503);
  assert.match(value.error, /^the Kubernetes API does not answer: /);
});

test("requests for scenes are checked before Agones is asked", async () => {
  const kWrong = [
    [{ scene: undefined }, "scene: must be a string of 1 to 128 bytes"],
    [{ scene: "My scene" }, "scene: must be 1 to 64 characters out of [a-z0-9_-]"],
    [{ scene: "a".repeat(65) }, "scene: must be 1 to 64 characters out of [a-z0-9_-]"],
    [{ subject: "" }, "subject: must be a string of 1 to 128 bytes"],
    [{ subject: "\u00e4".repeat(65) }, "subject: must be a string of 1 to 128 bytes"],
    [{ tenant: 7 }, "tenant: must be a string of 1 to 128 bytes"],
    [{ name: null }, "name: must be a string of 1 to 128 bytes"],
    [{ role: "admin" }, "role: must be viewer, participant or owner"],
    [{ rol: "owner" }, "rol: is unknown; use scene, tenant, subject, name, role"],
  ];
  for (const [more, error] of kWrong) assert.deepEqual(await ask(more), { status: 400, value: { error } });
  for (const body of ["", "{", "null", "[]", '"text"', "7"]) assert.equal((await send("POST", "/scenes", body)).status, 400, body);
  assert.equal((await send("POST", "/scenes", "x".repeat(300_000))).status, 413);
  assert.equal(api.calls.length, 0);
});

test("scenes and usage need the key, and other paths do not exist", async () => {
  for (const headers of [{}, { authorization: `Bearer ${kApiKey}x` }, { authorization: kApiKey }, { authorization: "Bearer " }]) {
    assert.equal((await ask({}, headers)).status, 401);
    assert.equal((await send("GET", "/usage", undefined, headers)).status, 401);
  }
  for (const place of ["GET /", "GET /scenes", "PUT /events", "GET /usage/", "POST /__proto__"])
    assert.equal((await send(...place.split(" "))).status, 404, place);
  assert.deepEqual(await send("GET", "/healthz", undefined, {}), { status: 200, value: {} });
  assert.equal(api.calls.length, 0);
});

let lastId = 0;
function signed(body, { id = `msg_${++lastId}`, seconds = Math.floor(Date.now() / 1000), secret = kSecret } = {}) {
  const signature = createHmac("sha256", secret).update(`${id}.${seconds}.${body}`).digest("base64");
  return { "webhook-id": id, "webhook-timestamp": String(seconds), "webhook-signature": `v1,${signature}` };
}
const eventOf = (type, tenant, more) => {
  const data = { server: "a", scene: "mine", participant: 3, role: "viewer", subject: "ada", tenant, ...more };
  return JSON.stringify({ type, timestamp: "2026-11-27T10:00:00.000Z", data });
};
const deliver = async (body, headers = signed(body)) => (await send("POST", "/events", body, headers)).status;
const usageOf = async (tenant) => (await send("GET", "/usage")).value.tenants[tenant];

test("usage is summed by tenant", async () => {
  assert.equal(await deliver(eventOf("participant.joined", "studio")), 204);
  assert.equal(await deliver(eventOf("scene.usage", "studio", { deviceSeconds: 1.5, sentBytes: 1000 })), 204);
  assert.equal(await deliver(eventOf("scene.usage", "studio", { deviceSeconds: 0.25, sentBytes: 24 })), 204);
  assert.equal(await deliver(eventOf("participant.left", "studio", { connectedSeconds: 61 })), 204);
  assert.equal(await deliver(eventOf("participant.left", "", { connectedSeconds: 5 })), 204);
  assert.equal(await deliver(eventOf("participant.left", "__proto__", { connectedSeconds: 6 })), 204);
  assert.deepEqual(await usageOf("studio"), { deviceSeconds: 1.75, sentBytes: 1024, connectedSeconds: 61 });
  assert.deepEqual(await usageOf(""), { deviceSeconds: 0, sentBytes: 0, connectedSeconds: 5 });
  assert.ok(Date.parse((await send("GET", "/usage")).value.since) <= Date.now());
});

test("an event that is delivered again counts once", async () => {
  const body = eventOf("participant.left", "again", { connectedSeconds: 10 });
  const now = Math.floor(Date.now() / 1000);
  for (const seconds of [now - 60, now - 30, now]) assert.equal(await deliver(body, signed(body, { id: "msg_again", seconds })), 204);
  assert.equal((await usageOf("again")).connectedSeconds, 10);
});

test("events with a wrong signature or time are refused, and count nothing", async () => {
  const body = eventOf("participant.left", "forged", { connectedSeconds: 10 });
  const now = Math.floor(Date.now() / 1000);
  const { "webhook-id": id, ...incomplete } = signed(body);
  assert.ok(id);
  assert.equal(await deliver(body, signed(body, { secret: randomBytes(32) })), 401);
  assert.equal(await deliver(body, signed(`${body} `)), 401);
  assert.equal(await deliver(body, { ...signed(body), "webhook-id": "msg_other" }), 401);
  assert.equal(await deliver(body, signed(body, { seconds: now - 400 })), 401);
  assert.equal(await deliver(body, signed(body, { seconds: now + 400 })), 401);
  assert.equal(await deliver(body, incomplete), 401);
  assert.equal(await deliver(body, {}), 401);
  assert.equal(await usageOf("forged"), undefined);
  const both = signed(body); // while a secret is replaced, a message has two signatures
  both["webhook-signature"] = `${signed(body, { secret: randomBytes(32) })["webhook-signature"]} ${both["webhook-signature"]}`;
  assert.equal(await deliver(body, both), 204);
  assert.equal((await usageOf("forged")).connectedSeconds, 10);
});

test("wrong amounts are refused, unknown events are accepted and count nothing", async () => {
  for (const connectedSeconds of [undefined, null, "5", [5], -1, 1e16])
    assert.equal(await deliver(eventOf("participant.left", "wrong", { connectedSeconds })), 400, String(connectedSeconds));
  assert.equal(await deliver(eventOf("scene.usage", "wrong", { deviceSeconds: 1 })), 400);
  assert.equal(await deliver(eventOf("participant.left", "x".repeat(129), { connectedSeconds: 1 })), 400);
  for (const body of ["", "{", "null", "7"]) assert.ok([204, 400].includes(await deliver(body)), body);
  assert.equal((await usageOf("wrong"))?.connectedSeconds ?? 0, 0);
  assert.equal(await deliver(eventOf("constructor", "later", {})), 204);
  assert.deepEqual((await usageOf("later"))?.deviceSeconds ?? 0, 0);
});

test("options are checked at the start", async () => {
  const complete = { key: at("2026-11.pem"), "api-key": at("api-key"), "events-secret": at("secret"), account: folder, port: 0 };
  const kWrong = [
    [{ key: "" }, "--key is required"],
    [{ key: at("absent.pem") }, "absent.pem"],
    [{ key: at("other.pem") }, "other.pem is not a key of the curve P-256"],
    [{ valid: "soon" }, "--valid: soon is not 60 to 31536000 seconds"],
    [{ "max-load": 1 }, "--max-load"],
  ];
  for (const [more, text] of kWrong) {
    const child = run({ ...complete, ...more });
    const [code] = await once(child, "close");
    assert.equal(code, 1);
    assert.ok(child.log.includes(text), child.log);
  }
});

test("SIGTERM ends the backend with 0, also with open connections", async () => {
  const other = await start();
  await fetch(`${other.url}/healthz`); // leaves a connection open
  const began = Date.now();
  other.process.kill("SIGTERM");
  const [code, signal] = await once(other.process, "exit");
  assert.deepEqual([code, signal], [0, null]);
  assert.ok(Date.now() - began < 4_000);
});
