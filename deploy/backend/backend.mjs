// SPDX-License-Identifier: MIT
// A reference backend for servers in an Agones fleet: chooses a server for a scene, makes tokens, and sums usage (README.md).

import { createHash, createPrivateKey, timingSafeEqual } from "node:crypto";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { request } from "node:https";
import { basename, join } from "node:path";
import { parseArgs } from "node:util";
import { SignJWT } from "jose";
import { Webhook } from "standardwebhooks";

const kMaxLength = 262_144; // characters of a request, and of an answer of Kubernetes
const kTimeoutMs = 5_000; // limit for a request, for a call of Kubernetes, and for open requests after SIGTERM
const kPlacedMs = 60_000; // a client creates its scene within this time; the list `scenes` of the server then has it
const [kMaxIds, kMaxPlacements, kMaxTenants] = [100_000, 10_000, 10_000];
const kAmounts = new Map(Object.entries({ "scene.usage": ["deviceSeconds", "sentBytes"], "participant.left": ["connectedSeconds"] }));
const kDefaults = {
  ...{ key: "", "api-key": "", "events-secret": "", port: "8080", address: "https://{address}:{port}", audience: "clothstream", valid: "28800" },
  ...{ fleet: "clothstream-server", namespace: "clothstream", kubernetes: "https://kubernetes.default.svc" },
  ...{ account: "/var/run/secrets/kubernetes.io/serviceaccount" },
};
const problem = (status, message) => Object.assign(new Error(message), { status });
const digest = (text) => createHash("sha256").update(text).digest();
const file = (name) => readFileSync(name, "utf8").trim();
const known = Object.entries(kDefaults).map(([name, value]) => [name, { type: "string", default: value }]);
const { values: options } = parseArgs({ options: Object.fromEntries(known) });
for (const name in kDefaults) if (!options[name]) throw new Error(`--${name} is required (deploy/backend/README.md)`);
if (!(options.valid >= 60 && options.valid <= 31_536_000)) throw new Error(`--valid: ${options.valid} is not 60 to 31536000 seconds`);
const signingKey = createPrivateKey(file(options.key));
if (signingKey.asymmetricKeyDetails?.namedCurve !== "prime256v1") throw new Error(`--key: ${options.key} is not a key of the curve P-256`);
const authorization = digest(`Bearer ${file(options["api-key"])}`);
const webhook = new Webhook(file(options["events-secret"]));

async function read(stream) {
  let text = "";
  for await (const chunk of stream.setEncoding("utf8").iterator({ destroyOnReturn: false }))
    if ((text += chunk).length > kMaxLength) throw problem(413, `the body has more than ${kMaxLength} characters`);
  return text;
}

function attempt(status, run) {
  try {
    return run();
  } catch (failure) {
    throw problem(status, failure.message);
  }
}
const parse = (text) => attempt(400, () => Object(JSON.parse(text)));

// Token and certificate of the Kubernetes API are read each time, because Kubernetes renews them.
function post(path, object) {
  return new Promise((resolve, reject) => {
    const headers = { authorization: `Bearer ${file(join(options.account, "token"))}`, "content-type": "application/json" };
    const settings = { method: "POST", headers, ca: file(join(options.account, "ca.crt")), signal: AbortSignal.timeout(kTimeoutMs) };
    const failed = (failure) => reject(problem(503, `the Kubernetes API does not answer: ${failure.message}`));
    const answered = (answer) => read(answer).then((text) => resolve([answer.statusCode, text]), failed);
    request(new URL(path, options.kubernetes), settings, answered).on("error", failed).end(JSON.stringify(object));
  });
}

// Allocates the server that has the scene, else the fullest server with room for another scene, else an unused one.
async function allocate(scene) {
  const selector = (gameServerState, more) => ({ matchLabels: { "agones.dev/fleet": options.fleet }, gameServerState, ...more });
  const [hasScene, hasRoom] = [{ lists: { scenes: { containsValue: scene } } }, { counters: { "created-scenes": { minAvailable: 1 } } }];
  const spec = {
    scheduling: "Packed",
    priorities: [{ type: "Counter", key: "created-scenes", order: "Ascending" }], // fullest first
    selectors: [selector("Allocated", hasScene), selector("Allocated", hasRoom), selector("Ready", hasRoom)],
  };
  const object = { apiVersion: "allocation.agones.dev/v1", kind: "GameServerAllocation", spec };
  const [status, text] = await post(`/apis/allocation.agones.dev/v1/namespaces/${options.namespace}/gameserverallocations`, object);
  if (status >= 300) throw problem([409, 429, 500, 503].includes(status) ? 503 : 502, `the Kubernetes API answered ${status}: ${text.slice(0, 300)}`);
  const { state, gameServerName, nodeName: node, address, ports } = JSON.parse(text).status;
  if (state !== "Allocated") throw problem(503, `no server has room (${state}); try again later`);
  const values = { node, address, port: ports.find(({ name }) => name === "web").port };
  return { name: gameServerName, address: options.address.replace(/\{(node|address|port)\}/g, (_, name) => values[name]) };
}

const placements = new Map(); // promise of a server by scene, so that two requests for a new scene get the same server
function place(scene) {
  if (placements.has(scene)) return placements.get(scene);
  if (placements.size >= kMaxPlacements) throw problem(503, "too many new scenes at a time; try again later");
  const [server, forget] = [allocate(scene), () => placements.delete(scene)];
  server.then(() => setTimeout(forget, kPlacedMs).unref(), forget);
  placements.set(scene, server);
  return server;
}

async function postScenes(text) {
  const { role = "participant", ...texts } = parse(text);
  if (!["viewer", "participant", "owner"].includes(role)) throw problem(400, "role: must be viewer, participant or owner");
  for (const name of new Set(["scene", "tenant", "subject", ...Object.keys(texts)])) {
    if (!["scene", "tenant", "subject", "name"].includes(name)) throw problem(400, `${name}: is unknown; use scene, tenant, subject, name, role`);
    if (typeof texts[name] !== "string" || !texts[name] || Buffer.byteLength(texts[name]) > 128)
      throw problem(400, `${name}: must be a string of 1 to 128 bytes`);
  }
  const { scene, subject, ...claims } = texts;
  if (!/^[a-z0-9_-]{1,64}$/.test(scene)) throw problem(400, "scene: must be 1 to 64 characters out of [a-z0-9_-]");
  const server = await place(scene);
  const all = { ...claims, sub: subject, role, aud: options.audience, exp: Math.floor(Date.now() / 1000 + Number(options.valid)) };
  const token = new SignJWT(role === "owner" ? all : { ...all, scene }); // a token for one scene cannot create it
  return { server, scene, token: await token.setProtectedHeader({ alg: "ES256", kid: basename(options.key, ".pem") }).sign(signingKey) };
}

const [since, ids, tenants] = [new Date().toISOString(), new Set(), new Map()]; // ids of the newest events; sums by tenant
function postEvents(text, headers) {
  attempt(401, () => webhook.verify(text, headers, { jsonParse: false }));
  const { type, data } = parse(text);
  const { tenant = "", ...given } = Object(data);
  const amounts = kAmounts.get(type) ?? []; // other events count nothing
  if (typeof tenant !== "string" || Buffer.byteLength(tenant) > 128) throw problem(400, "data.tenant: must be a string of at most 128 bytes");
  for (const name of amounts)
    if (!Number.isFinite(given[name]) || given[name] < 0 || given[name] > 1e15) throw problem(400, `data.${name}: must be a number, 0 to 1e15`);
  if (ids.has(headers["webhook-id"])) return;
  const sums = tenants.get(tenant) ?? { deviceSeconds: 0, sentBytes: 0, connectedSeconds: 0 };
  if (!tenants.has(tenant) && tenants.size >= kMaxTenants) throw problem(422, `there are more than ${kMaxTenants} tenants`);
  for (const name of amounts) sums[name] += given[name];
  if (ids.add(headers["webhook-id"]).size > kMaxIds) ids.delete(ids.values().next().value);
  tenants.set(tenant, sums);
}
const kEndpoints = new Map([
  ["POST /scenes", { run: postScenes, needsKey: true }],
  ["POST /events", { run: postEvents }],
  ["GET /usage", { run: () => ({ since, tenants: Object.fromEntries(tenants) }), needsKey: true }],
  ["GET /healthz", { run: () => ({}) }],
]);
async function answer(incoming) {
  const { method, url, headers } = incoming;
  const endpoint = kEndpoints.get(`${method} ${url}`);
  if (!endpoint) throw problem(404, `${method} is not possible here; use ${[...kEndpoints.keys()].join(", ")}`);
  if (endpoint.needsKey && !timingSafeEqual(digest(headers.authorization ?? ""), authorization))
    throw problem(401, "Authorization: must be Bearer and the key in the file of --api-key");
  return endpoint.run(await read(incoming), headers);
}
const server = createServer({ requestTimeout: kTimeoutMs, connectionsCheckingInterval: 1_000, maxHeaderSize: 8_192 }, async (incoming, response) => {
  const [status, value] = await answer(incoming).then(
    (value) => [value ? 200 : 204, value],
    (failure) => [failure.status ?? 500, { error: failure.status ? failure.message : (console.error(failure), "internal error") }],
  );
  const headers = { "content-type": "application/json", ...(status >= 400 && { connection: "close" }) };
  response.writeHead(status, headers).end(value && JSON.stringify(value));
});
server.maxConnections = 256;
server.listen(options.port, () => console.log(`listening on port ${server.address().port}`));
process.once("SIGTERM", () => {
  server.close();
  server.closeIdleConnections();
  setTimeout(() => server.closeAllConnections(), kTimeoutMs).unref();
});
