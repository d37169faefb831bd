// SPDX-License-Identifier: MIT
// Builds the manifests of deploy/kubernetes with kubectl, and checks the objects without a cluster: schemas, names that
// refer to each other, options of the server, rights, and a cluster of three NATS servers with their configuration, which
// servers, an edge and an operator use with the documented permissions.
// No package has the schemas of Agones, so the test itself says which fields its objects have; the schemas of Kubernetes
// hold for the template of its pods.

import assert from "node:assert/strict";
import { execFile, execFileSync, spawnSync } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { makeAccounts } from "./nats_accounts.mjs";
import { startProcess, until, withCluster } from "./nats_cluster.mjs";

const kSkipped = 77; // CMake's SKIP_RETURN_CODE for this test
const source = fileURLToPath(new URL("../../", import.meta.url));
const room = fileURLToPath(new URL(".", import.meta.url));
const web = join(source, "clients/web");

function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(kSkipped);
}
if (spawnSync("kubectl", ["version", "--client"]).status !== 0) skip("there is no kubectl (apt install kubernetes-client)");
for (const name of [join(room, "node_modules/kubernetes-models"), join(room, "node_modules/yaml"), join(web, "node_modules/typescript")])
  if (!existsSync(name)) skip(`${name} is missing; the build installs it (ninja test_kubernetes)`);

const { parseAllDocuments } = await import("yaml");
const ts = createRequire(join(web, "package.json"))("typescript");
const read = (path) => readFileSync(join(source, path), "utf8");
const version = /^project\(clothstream VERSION (\S+)/m.exec(read("CMakeLists.txt"))[1];
const documentation = /^## Kubernetes\n(.*?)\n## /ms.exec(read("docs/operations.md"))[1];
const aboutAgones = /^## Many scenes: Agones\n(.*?)\n## /ms.exec(read("docs/fleet.md"))[1];
const server = process.env.CLOTHSTREAM_SERVER;
const help = execFileSync(server, ["--help"], { encoding: "utf8" });
const kComponent = "app.kubernetes.io/component";

// User, volumes and variables of the image, from deploy/image/build_image.sh.
const script = read("deploy/image/build_image.sh");
const image = {
  user: Number(/^readonly kUser=(\d+)/m.exec(script)[1]),
  volumes: [...script.matchAll(/--volume (\S+)/g)].map((match) => match[1]),
  environment: Object.fromEntries([...script.matchAll(/--env (\w+)=(\S+)/g)].map((match) => [match[1], match[2]])),
};

let folder;
const builds = {}; // objects by name of the build
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-kubernetes-"));
  const copy = join(folder, "clothstream/deploy/kubernetes");
  await cp(join(source, "deploy/kubernetes"), copy, { recursive: true });
  for (const name of ["base", "overlays/gpu", "overlays/fleet", "overlays/agones"]) builds[name] = kustomize(join(source, "deploy/kubernetes", name));

  // An operator's own overlay, as documented.
  const [own, nodes] = [...documentation.matchAll(/^```yaml\n(.*?)^```/gms)].map((match) => match[1]);
  builds.own = await kustomizeText("own", own);
  builds["own with Agones"] = await kustomizeText("own-agones", own.replace("overlays/fleet", "overlays/agones") + nodes);

  const fleet = join(copy, "overlays/fleet/kustomization.yaml");
  const text = await readFile(fleet, "utf8");
  assert.match(text, /^bases: \[\.\.\/gpu, /m);
  await writeFile(fleet, text.replace("../gpu", "../../base"));
  builds["fleet without GPU"] = kustomize(join(copy, "overlays/fleet"));
});
after(() => rm(folder, { recursive: true, force: true }));

function kustomize(directory) {
  const output = execFileSync("kubectl", ["kustomize", directory], { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
  const objects = parseAllDocuments(output).map((document) => {
    assert.deepEqual([...document.errors, ...document.warnings], []);
    return document.toJS();
  });
  const names = objects.map(nameOf);
  assert.equal(new Set(names).size, names.length);
  return objects;
}

async function kustomizeText(name, text) {
  await mkdir(join(folder, name));
  await writeFile(join(folder, name, "kustomization.yaml"), text);
  return kustomize(join(folder, name));
}

const nameOf = (object) => `${object.kind} ${object.metadata.name}`;
const ofKind = (objects, kind) => objects.filter((object) => object.kind === kind);
const named = (objects, kind, name) => {
  const found = objects.find((object) => object.kind === kind && object.metadata.name === name);
  assert.ok(found, `there is no ${kind} ${name}`);
  return found;
};
const workloads = (objects) => objects.filter((object) => object.spec?.template);
const isAgones = (object) => /^(autoscaling\.)?agones\.dev\//.test(object.apiVersion);
const isFleet = (object) => object.kind === "Fleet";
// The template of a Fleet is a GameServer, which has the template of a pod.
const templateOf = (workload) => (isFleet(workload) ? workload.spec.template.spec.template : workload.spec.template);
const labelsOf = (workload) => templateOf(workload).metadata.labels;
const componentOf = (workload) => labelsOf(workload)[kComponent];
const podOf = (workload) => templateOf(workload).spec;
const isOurs = (container) => container.image.includes("clothstream-server");

function matches(selector, labels) {
  assert.ok(Object.keys(selector.matchLabels ?? {}).length + (selector.matchExpressions ?? []).length > 0, "the selector is empty");
  return (
    Object.entries(selector.matchLabels ?? {}).every(([key, value]) => labels[key] === value) &&
    (selector.matchExpressions ?? []).every(({ key, operator, values }) => {
      assert.equal(operator, "In");
      return values.includes(labels[key]);
    })
  );
}

// Workloads with pods that a selector finds. There must be one.
function selected(objects, selector, what) {
  const found = workloads(objects).filter((workload) => matches(selector, labelsOf(workload)));
  assert.ok(found.length > 0, `${what} selects no pod`);
  return found;
}

const portsOf = (workload) => podOf(workload).containers.flatMap((container) => container.ports.map((port) => port.name));
// Whether a Service or a policy names the protocol of a port of the pod.
const fitsProtocol = (workload, name, protocol) =>
  podOf(workload).containers.some((container) => container.ports.some((port) => port.name === name && (port.protocol ?? "TCP") === (protocol ?? "TCP")));

// Runs a check for each build.
function testEach(title, check) {
  test(title, async (t) => {
    for (const [name, objects] of Object.entries(builds)) await t.test(name, () => check(objects, name));
  });
}

// Objects of Kubernetes: for a Fleet the template of its pods.
const ofKubernetes = (objects) => [
  ...objects.filter((object) => !isAgones(object)),
  ...ofKind(objects, "Fleet").map((fleet) => ({ apiVersion: "v1", kind: "PodTemplate", metadata: fleet.metadata, template: templateOf(fleet) })),
];

testEach("objects have the schemas of Kubernetes", async (objects) => {
  for (const object of ofKubernetes(objects)) {
    const models = await import(`kubernetes-models/${object.apiVersion}/${object.kind}`);
    assert.doesNotThrow(() => new models[object.kind](object).validate(), nameOf(object));
  }
});

// The schemas allow fields that they do not know, such as misspelt ones. TypeScript does not.
test("objects have no unknown fields", () => {
  const lines = Object.values(builds)
    .flatMap(ofKubernetes)
    .map((object) => `(${JSON.stringify(object)}) satisfies import("kubernetes-models/${object.apiVersion}/${object.kind}").I${object.kind};`);
  const misspelt = lines.find((line) => line.includes('"readinessProbe":')).replace('"readinessProbe":', '"readynessProbe":');
  const problems = compile([...new Set(lines), misspelt]);
  assert.deepEqual(
    problems.filter((problem) => !problem.includes("readynessProbe")),
    [],
  );
  assert.equal(problems.length, 1);
});

function compile(lines) {
  const options = {
    strict: true,
    noEmit: true,
    skipLibCheck: true,
    types: [],
    module: ts.ModuleKind.ESNext,
    moduleResolution: ts.ModuleResolutionKind.Bundler,
  };
  const file = join(room, "objects.ts"); // in memory
  const host = ts.createCompilerHost(options);
  const { getSourceFile, fileExists } = host;
  host.fileExists = (name) => name === file || fileExists.call(host, name);
  host.getSourceFile = (name, ...rest) =>
    name === file ? ts.createSourceFile(name, lines.join("\n"), ts.ScriptTarget.ES2022) : getSourceFile.call(host, name, ...rest);
  return ts
    .getPreEmitDiagnostics(ts.createProgram([file], options, host))
    .map((problem) => ts.flattenDiagnosticMessageText(problem.messageText, "\n"));
}

testEach("everything is in the namespace, which restricts pods, except with Agones", (objects) => {
  const [namespace, ...others] = ofKind(objects, "Namespace");
  assert.deepEqual(others, []);
  // Ports of nodes, which Agones gives to pods, need the other profile.
  const profile = objects.some(isAgones) ? "privileged" : "restricted";
  assert.equal(namespace.metadata.labels["pod-security.kubernetes.io/enforce"], profile);
  for (const object of objects) if (object !== namespace) assert.equal(object.metadata.namespace, namespace.metadata.name, nameOf(object));
});

testEach("images are those of this version, or NATS", (objects) => {
  for (const { image } of workloads(objects).flatMap((workload) => podOf(workload).containers))
    assert.match(
      image,
      new RegExp(`^([\\w.-]+\\.example\\.\\w+/clothstream-(server|backend):${version.replaceAll(".", "\\.")}|docker\\.io/library/nats:\\d[\\w.-]*)$`),
    );
});

testEach("pods have no rights that they do not need", (objects) => {
  for (const workload of workloads(objects)) {
    const pod = podOf(workload);
    assert.equal(pod.enableServiceLinks, false);
    if (isFleet(workload))
      // Agones sets the account of its sidecar, and hides the token of it from the server.
      assert.deepEqual([pod.serviceAccountName, pod.automountServiceAccountToken], [undefined, undefined]);
    else {
      const account = named(objects, "ServiceAccount", pod.serviceAccountName);
      assert.deepEqual([account.automountServiceAccountToken, pod.automountServiceAccountToken], [false, false]);
    }
    assert.deepEqual([pod.hostNetwork, pod.hostPID, pod.hostIPC], [undefined, undefined, undefined]);
    assert.equal(pod.securityContext.runAsNonRoot, true);
    assert.ok(pod.securityContext.runAsUser > 0);
    assert.equal(pod.securityContext.fsGroup, pod.securityContext.runAsGroup);
    assert.equal(pod.securityContext.seccompProfile.type, "RuntimeDefault");
    assert.equal(pod.initContainers, undefined);
    for (const container of pod.containers) {
      if (isOurs(container)) assert.deepEqual([pod.securityContext.runAsUser, pod.securityContext.runAsGroup], [image.user, image.user]);
      assert.deepEqual(container.securityContext, { allowPrivilegeEscalation: false, readOnlyRootFilesystem: true, capabilities: { drop: ["ALL"] } });
    }
    for (const volume of pod.volumes)
      assert.match(
        Object.keys(volume).find((key) => key !== "name"),
        /^(configMap|emptyDir|projected|secret)$/,
      );
  }
});

testEach("probes ask the port for operators", (objects) => {
  for (const workload of workloads(objects)) {
    for (const container of podOf(workload).containers) {
      const [ready, alive] = [container.readinessProbe.httpGet, container.livenessProbe?.httpGet];
      const port = container.ports.find(({ name }) => name === ready.port);
      assert.ok(port, `${nameOf(workload)} has no port ${ready.port}`);
      // Without a majority of its servers, NATS still carries frames.
      const path = componentOf(workload) === "nats" ? "/healthz?js-enabled-only=true" : "/healthz";
      assert.deepEqual(alive, isFleet(workload) ? undefined : { path, port: ready.port });
      const started = componentOf(workload) === "nats" ? { path: "/healthz", port: ready.port } : undefined;
      assert.deepEqual(container.startupProbe?.httpGet, started);
      if (componentOf(workload) === "nats") assert.equal(ready.path, path);
      if (!isOurs(container)) continue;
      assert.equal(ready.path, "/readyz");
      const config = effective(objects, container);
      assert.deepEqual(Object.fromEntries(container.ports.map(({ name, containerPort }) => [name, containerPort])), {
        web: config.port,
        grpc: config["grpc-port"],
        metrics: config["metrics-port"],
        ...(config.transport === "tcp" ? {} : { datagrams: config["datagram-port"] }),
      });
      assert.equal(port.name, "metrics");
      assert.deepEqual([config.host, config["metrics-host"]], ["0.0.0.0", "0.0.0.0"]); // kubelet does not use the loopback address
    }
  }
});

testEach("requests and limits are set", (objects) => {
  const kUnits = { m: 1e-3, Mi: 2 ** 20, Gi: 2 ** 30, MiB: 2 ** 20, GB: 2 ** 30 }; // NATS' GB is Gi
  const amount = (text) => {
    const [, number, unit] = /^(\d+)(m|Mi|Gi|MiB|GB)?$/.exec(text);
    return Number(number) * (kUnits[unit] ?? 1);
  };
  const nats = workloads(objects).find((workload) => componentOf(workload) === "nats");
  if (nats) {
    const limit = (name) => amount(new RegExp(`^ +max_${name}_store: (\\w+)`, "m").exec(natsConfiguration(objects))[1]);
    const [claim] = nats.spec.volumeClaimTemplates;
    assert.equal(limit("memory"), 0);
    assert.ok(limit("file") > 0 && limit("file") <= 0.8 * amount(claim.spec.resources.requests.storage)); // deleted entries need room, too
    const [container] = podOf(nats).containers;
    assert.ok(amount(environmentOf(objects, container).GOMEMLIMIT) <= 0.9 * amount(container.resources.limits.memory));
  }
  for (const workload of workloads(objects)) {
    for (const { resources } of podOf(workload).containers) {
      assert.ok(amount(resources.requests.cpu) >= 0.1);
      assert.ok(amount(resources.requests.memory) >= 64 * kUnits.Mi);
      assert.ok(amount(resources.limits.memory) >= amount(resources.requests.memory));
    }
    for (const volume of podOf(workload).volumes) if (volume.emptyDir) assert.ok(amount(volume.emptyDir.sizeLimit) > 0);
  }
  const origin = workloads(objects).find((workload) => componentOf(workload) === "server");
  const config = effective(objects, podOf(origin).containers[0]);
  if (isFleet(origin)) {
    // Its volume ends with the pod, so it keeps no states.
    assert.equal(environmentOf(objects, podOf(origin).containers[0]).CLOTHSTREAM_STATE_DIR, "");
    return;
  }
  const [claim] = origin.spec.volumeClaimTemplates;
  assert.ok(amount(claim.spec.resources.requests.storage) >= (2 * config["state-limit"] + config["keep-free"]) * 1e6);
});

testEach("pods have the time to drain", (objects) => {
  for (const workload of workloads(objects)) {
    for (const container of podOf(workload).containers.filter(isOurs)) {
      const pause = Number(container.lifecycle?.preStop.exec.command[1] ?? 0);
      assert.ok(podOf(workload).terminationGracePeriodSeconds > effective(objects, container).drain + pause + 1, nameOf(workload));
    }
  }
});

testEach("selectors find pods with these ports", (objects) => {
  for (const workload of workloads(objects)) {
    if (!isFleet(workload)) assert.deepEqual(selected(objects, workload.spec.selector, nameOf(workload)), [workload]);
    for (const constraint of podOf(workload).topologySpreadConstraints ?? [])
      assert.deepEqual(selected(objects, constraint.labelSelector, nameOf(workload)), [workload]);
    if (workload.kind !== "StatefulSet") continue;
    const governing = named(objects, "Service", workload.spec.serviceName);
    assert.equal(governing.spec.clusterIP, "None");
    assert.deepEqual(selected(objects, { matchLabels: governing.spec.selector }, nameOf(governing)), [workload]);
  }
  for (const service of ofKind(objects, "Service")) {
    const [workload, ...others] = selected(objects, { matchLabels: service.spec.selector }, nameOf(service));
    assert.deepEqual(others, []);
    for (const { targetPort, protocol } of service.spec.ports) assert.ok(fitsProtocol(workload, targetPort, protocol), `${nameOf(service)}: ${targetPort}`);
    if (service.spec.type === "LoadBalancer")
      assert.deepEqual(
        service.spec.ports.map(({ targetPort }) => targetPort),
        ["web"],
      );
  }
  const budgets = ofKind(objects, "PodDisruptionBudget").map((budget) => {
    const [workload, ...others] = selected(objects, budget.spec.selector, nameOf(budget));
    assert.deepEqual(others, []);
    return workload;
  });
  assert.deepEqual(new Set(budgets), new Set(workloads(objects).filter((workload) => !isFleet(workload)))); // Agones has one for its pods
});

// Names of the components that may reach a port of a workload; "everyone" for a rule without senders.
function senders(objects, workload, port) {
  const found = new Set();
  for (const policy of ofKind(objects, "NetworkPolicy")) {
    if (!selected(objects, policy.spec.podSelector, nameOf(policy)).includes(workload)) continue;
    for (const rule of policy.spec.ingress ?? []) {
      assert.ok(rule.ports?.length > 0, `${nameOf(policy)} opens all ports`);
      if (!rule.ports.some((entry) => entry.port === port)) continue;
      if (!rule.from) found.add("everyone");
      for (const peer of rule.from ?? [])
        if (peer.namespaceSelector) found.add(`namespace ${peer.namespaceSelector.matchLabels["kubernetes.io/metadata.name"]}`);
        else for (const from of selected(objects, peer.podSelector, nameOf(policy))) found.add(componentOf(from));
    }
  }
  return [...found].sort();
}

testEach("network policies let in and out what is needed", (objects) => {
  const policies = ofKind(objects, "NetworkPolicy");
  for (const policy of policies) {
    const targets = selected(objects, policy.spec.podSelector, nameOf(policy));
    for (const { port, protocol } of (policy.spec.ingress ?? []).flatMap((rule) => rule.ports))
      for (const target of targets) assert.ok(fitsProtocol(target, port, protocol), `${nameOf(policy)}: ${port}`);
    for (const rule of policy.spec.egress ?? [])
      for (const peer of rule.to ?? [])
        for (const { port } of rule.ports)
          for (const to of selected(objects, peer.podSelector, nameOf(policy))) assert.ok(portsOf(to).includes(port), `${nameOf(policy)}: ${port}`);
  }
  const kAllowed = {
    server: { web: ["everyone"], datagrams: ["everyone"], grpc: [], metrics: ["namespace monitoring"] },
    edge: { web: ["everyone"], grpc: [], metrics: ["namespace monitoring"] },
    nats: { nats: ["edge", "server"], routes: ["nats"], monitor: [] },
    backend: { http: ["namespace application", "server"] },
  };
  const kNames = [53, 53]; // UDP and TCP
  const kApi = [443, 6443];
  const [hasNats, hasAgones] = [workloads(objects).length > 1, objects.some(isAgones)];
  const kMayReach = {
    server: [...(hasNats ? ["nats", ...kNames] : []), ...(hasAgones ? ["backend", ...kApi] : [])], // the sidecar uses the API
    edge: ["nats", ...kNames],
    nats: ["nats", ...kNames],
    backend: [...kApi, ...kNames],
  };
  for (const workload of workloads(objects)) {
    const own = policies.filter((policy) => matches(policy.spec.podSelector, labelsOf(workload)));
    for (const direction of ["Ingress", "Egress"])
      assert.ok(
        own.some((policy) => policy.spec.policyTypes.includes(direction)),
        `${nameOf(workload)} has no policy for ${direction}`,
      );
    for (const port of portsOf(workload))
      assert.deepEqual(senders(objects, workload, port), kAllowed[componentOf(workload)][port], `${nameOf(workload)}: ${port}`);
    const receivers = own
      .flatMap((policy) => policy.spec.egress ?? [])
      .flatMap((rule) =>
        rule.to
          ? rule.to.flatMap((peer) => selected(objects, peer.podSelector, nameOf(workload)).map(componentOf))
          : rule.ports.map(({ port }) => port),
      );
    assert.deepEqual(receivers.sort(), kMayReach[componentOf(workload)].sort());
  }
});

// Values for fields that a pod refers to.
const kFields = { "metadata.name": "pod-0", "metadata.namespace": "clothstream", "spec.nodeName": "node-1", "status.hostIP": "192.0.2.7" };

function expand(text, variables) {
  return text.replace(/\$\((\w+)\)/g, (_, name) => {
    assert.ok(name in variables, `${text}: there is no ${name}`);
    return variables[name];
  });
}

// Variables of a container, those of the image included.
function environmentOf(objects, container) {
  const variables = isOurs(container) ? { ...image.environment } : {};
  for (const { configMapRef } of container.envFrom ?? []) Object.assign(variables, named(objects, "ConfigMap", configMapRef.name).data);
  for (const { name, value, valueFrom } of container.env ?? []) {
    const { fieldRef, configMapKeyRef: entry } = valueFrom ?? {};
    if (fieldRef) variables[name] = kFields[fieldRef.fieldPath];
    else if (entry) variables[name] = named(objects, "ConfigMap", entry.name).data[entry.key];
    else variables[name] = expand(value, variables);
    assert.equal(typeof variables[name], "string", `${name} has no value`);
  }
  return variables;
}

const listed = (option) => new RegExp(`^ +(-\\w,)?${option}\\b`, "m").test(help);
const optionOf = (variable) => `--${variable.replace("CLOTHSTREAM_", "").toLowerCase().replaceAll("_", "-")}`;

// Options that the server has with the variables and arguments of a container.
const printed = new Map();
function effective(objects, container) {
  const known = Object.entries(environmentOf(objects, container)).filter(([name]) => name.startsWith("CLOTHSTREAM_"));
  const args = container.args ?? [];
  const key = JSON.stringify([known, args]);
  if (!printed.has(key)) {
    const { status, stdout, stderr } = spawnSync(server, [...args, "--print-config"], { encoding: "utf8", env: Object.fromEntries(known) });
    assert.deepEqual([status, stderr], [0, ""]);
    printed.set(key, Object.fromEntries([...stdout.matchAll(/^([\w-]+) = (.*)$/gm)].map(([, name, value]) => [name, JSON.parse(value)])));
  }
  return printed.get(key);
}

// The server tells clients the address of its node and its own port, so each step on the way has the same number.
testEach("datagrams reach the server by its node", (objects) => {
  for (const workload of workloads(objects)) {
    for (const container of podOf(workload).containers.filter(isOurs)) {
      const config = effective(objects, container);
      const ways = ofKind(objects, "Service").filter((service) => service.spec.ports.some(({ targetPort }) => targetPort === "datagrams"));
      const own = ways.filter((service) => matches({ matchLabels: service.spec.selector }, labelsOf(workload)));
      assert.equal(own.length, config.transport === "tcp" ? 0 : 1, nameOf(workload));
      for (const { spec } of own) {
        const number = config["datagram-port"];
        assert.deepEqual(spec.ports, [{ name: "datagrams", protocol: "UDP", port: number, targetPort: "datagrams", nodePort: number }]);
        assert.ok(number >= 30000 && number <= 32767); // NodePorts of Kubernetes
        assert.equal(spec.externalTrafficPolicy, "Local"); // another node would hide the address of the client
        assert.deepEqual(config["public-address"], [kFields["status.hostIP"]]);
        assert.equal(workload.spec.replicas, 1);
      }
    }
  }
});

testEach("the server has every option", (objects) => {
  for (const container of workloads(objects)
    .flatMap((workload) => podOf(workload).containers)
    .filter(isOurs)) {
    const options = Object.keys(environmentOf(objects, container))
      .filter((name) => name.startsWith("CLOTHSTREAM_"))
      .map(optionOf);
    options.push(...(container.args ?? []).map((arg) => arg.split("=")[0]));
    assert.ok(options.length > 5);
    for (const option of options) assert.ok(listed(option), `there is no option ${option}`);
    effective(objects, container);
  }
});

// Secrets and their files that operators make, from the table of the documentation.
const secrets = new Map(
  [...documentation.matchAll(/^\| `(clothstream-[\w-]+)` \| (.*?) \|/gm)].map(([, name, files]) => [
    name,
    [...files.matchAll(/`([\w.-]+)`/g)].map((match) => match[1]),
  ]),
);

// Fails unless a path is in a volume of the pod, and is a file that its secret or ConfigMap has.
function checkPath(objects, workload, container, path) {
  const mount = container.volumeMounts.find(({ mountPath }) => path === mountPath || path.startsWith(`${mountPath}/`));
  assert.ok(mount, `${nameOf(workload)}: ${path} is in no volume`);
  if (path === mount.mountPath) return mount;
  const volume = podOf(workload).volumes.find(({ name }) => name === mount.name);
  const files = [];
  if (volume.secret) files.push(...secrets.get(volume.secret.secretName));
  if (volume.configMap) files.push(...Object.keys(named(objects, "ConfigMap", volume.configMap.name).data));
  for (const { secret } of volume.projected?.sources ?? []) files.push(...(secret?.items ?? []).map((item) => item.path));
  assert.ok(files.includes(path.slice(mount.mountPath.length + 1)), `${nameOf(workload)}: ${path} is not in its volume`);
  return mount;
}

testEach("volumes, secrets and files exist", (objects) => {
  for (const workload of workloads(objects)) {
    const pod = podOf(workload);
    const claims = (workload.spec.volumeClaimTemplates ?? []).map((claim) => claim.metadata.name);
    const volumes = [...pod.volumes.map((volume) => volume.name), ...claims].sort();
    for (const container of pod.containers) {
      assert.deepEqual(container.volumeMounts.map(({ name }) => name).sort(), volumes, nameOf(workload));
      const args = (container.args ?? []).map((arg) => arg.replace(/^--[\w-]+=/, ""));
      const values = [...Object.values(environmentOf(objects, container)), ...args].filter((value) => value.startsWith("/"));
      if (isOurs(container)) {
        for (const path of [...image.volumes, ...values, "/tmp"]) checkPath(objects, workload, container, path);
        const state = checkPath(objects, workload, container, image.environment.CLOTHSTREAM_STATE_DIR).name;
        assert.equal(claims.includes(state), workload.kind === "StatefulSet");
        continue;
      }
      if (componentOf(workload) === "backend") {
        for (const path of values) checkPath(objects, workload, container, path);
        assert.ok(values.length >= 3);
        continue;
      }
      const config = container.args.at(-1);
      checkPath(objects, workload, container, config);
      const text = natsConfiguration(objects);
      const store = /^ +store_dir: (\S+)$/m.exec(text)[1];
      assert.deepEqual(claims, [checkPath(objects, workload, container, store).name]);
      for (const [path] of text.matchAll(/\/etc\/\S+/g)) checkPath(objects, workload, container, path);
      for (const [, path] of text.matchAll(/^include (\S+)/gm)) checkPath(objects, workload, container, join(config, "..", path));
    }
    for (const volume of pod.volumes) {
      const used = volume.secret ? [{ name: volume.secret.secretName }] : (volume.projected?.sources ?? []).flatMap(({ secret }) => secret ?? []);
      for (const { name, items } of used) {
        assert.ok(secrets.has(name), `docs/operations.md does not have the Secret ${name}`);
        for (const { key } of items ?? []) assert.ok(secrets.get(name).includes(key), `${name} has no ${key}`);
      }
    }
  }
});

testEach("only containers with a GPU see one", (objects, name) => {
  let count = 0;
  for (const workload of workloads(objects)) {
    for (const container of podOf(workload).containers.filter(isOurs)) {
      const visible = environmentOf(objects, container).NVIDIA_VISIBLE_DEVICES;
      const gpus = container.resources.limits["nvidia.com/gpu"];
      if (gpus === undefined) {
        assert.equal(visible, "void");
        continue;
      }
      assert.equal(typeof gpus, isFleet(workload) ? "string" : "number");
      count += Number(gpus);
      assert.equal(visible, image.environment.NVIDIA_VISIBLE_DEVICES); // the device plugin replaces it
      assert.match(image.environment.NVIDIA_DRIVER_CAPABILITIES, /\bgraphics\b/);
      assert.ok(podOf(workload).tolerations.some(({ key, operator }) => key === "nvidia.com/gpu" && operator === "Exists"));
      assert.equal(componentOf(workload), "server");
    }
  }
  assert.equal(count, ["base", "fleet without GPU"].includes(name) ? 0 : 1);
});

testEach("the autoscaler has a target", (objects) => {
  for (const scaler of ofKind(objects, "HorizontalPodAutoscaler")) {
    assert.equal(scaler.apiVersion, "autoscaling/v2");
    const target = named(objects, scaler.spec.scaleTargetRef.kind, scaler.spec.scaleTargetRef.name);
    assert.equal(target.apiVersion, scaler.spec.scaleTargetRef.apiVersion);
    assert.equal(target.spec.replicas, undefined); // each `kubectl apply` would reset it
    assert.ok(scaler.spec.minReplicas >= 2 && scaler.spec.maxReplicas > scaler.spec.minReplicas);
    assert.deepEqual(
      scaler.spec.metrics.map(({ resource }) => resource.name),
      ["cpu"],
    );
  }
  assert.equal(ofKind(objects, "HorizontalPodAutoscaler").length, workloads(objects).filter((workload) => componentOf(workload) === "edge").length);
});

// Runs a check for each build with Agones.
function testAgones(title, check) {
  testEach(title, (objects) => {
    for (const fleet of ofKind(objects, "Fleet")) check(fleet, objects);
  });
}

// Counters and the list, from the table of the documentation with three columns.
const rows = [...aboutAgones.matchAll(/^\| `([\w-]+)`( \(list\))? \|[^|]*\|[^|]*\|$/gm)];
const counters = rows.map(([, name, isList]) => ({ name, isList: isList !== undefined }));

testAgones("the fleet has the counters and the list of the documentation", (fleet, objects) => {
  const { counters: counts, lists } = fleet.spec.template.spec;
  const names = (isList) => counters.filter((entry) => entry.isList === isList).map(({ name }) => name);
  assert.deepEqual(Object.keys(counts).sort(), names(false).sort());
  assert.deepEqual(Object.keys(lists), names(true));
  assert.deepEqual(names(false).length + names(true).length, 4);
  for (const [name, counter] of Object.entries(counts)) {
    assert.deepEqual(Object.keys(counter).sort(), ["capacity", "count"], name);
    assert.equal(counter.count, 0);
  }
  const config = effective(objects, podOf(fleet).containers[0]);
  assert.equal(counts["created-scenes"].capacity, config["max-created-scenes"]);
  assert.equal(counts.load.capacity, 1000 * config["max-load"]);
  assert.equal(counts.participants.capacity, config["max-participants"]);
  for (const list of Object.values(lists)) assert.deepEqual(list, { capacity: 1000, values: [] }); // 1000 is the most that Agones allows
});

testAgones("the fleet runs game servers", (fleet, objects) => {
  const kGameServer = ["counters", "eviction", "health", "lists", "ports", "template"];
  assert.equal(fleet.apiVersion, "agones.dev/v1");
  assert.deepEqual(Object.keys(fleet.spec).sort(), ["scheduling", "template"]); // no `replicas`: each `kubectl apply` would reset it
  assert.deepEqual(Object.keys(fleet.spec.template).sort(), ["metadata", "spec"]);
  assert.deepEqual(fleet.spec.template.metadata.labels, labelsOf(fleet));
  const { spec } = fleet.spec.template;
  assert.deepEqual(Object.keys(spec).sort(), kGameServer);
  const [container, ...others] = podOf(fleet).containers;
  assert.deepEqual(others, []);
  const config = effective(objects, container);
  assert.equal(config.agones, true);
  assert.deepEqual(spec.ports, [{ name: "web", portPolicy: "Dynamic", containerPort: config.port, protocol: "TCP" }]);
  const kSidecar = [8080, 9357, 9358]; // its ports for probes, gRPC and REST
  for (const { containerPort } of container.ports) assert.ok(!kSidecar.includes(containerPort), `the sidecar has port ${containerPort}`);
  assert.deepEqual(spec.eviction, { safe: "Never" });
  const { initialDelaySeconds, periodSeconds, failureThreshold, ...rest } = spec.health;
  assert.deepEqual(rest, {});
  assert.ok(initialDelaySeconds >= 30 && periodSeconds > 2 && failureThreshold > 1); // the server reports every two seconds
  assert.equal(environmentOf(objects, container).CLOTHSTREAM_PUBLIC_NAME, `node-1.${environmentOf(objects, container).NODE_DOMAIN}`);
});

testAgones("the autoscaler of the fleet counts created scenes", (fleet, objects) => {
  const [scaler, ...others] = ofKind(objects, "FleetAutoscaler");
  assert.deepEqual(others, []);
  assert.equal(scaler.apiVersion, "autoscaling.agones.dev/v1");
  const { key, bufferSize, minCapacity, maxCapacity, ...rest } = scaler.spec.policy.counter;
  assert.deepEqual(scaler.spec, {
    fleetName: fleet.metadata.name,
    policy: { type: "Counter", counter: scaler.spec.policy.counter },
    sync: { type: "FixedInterval", fixedInterval: { seconds: 30 } },
  });
  assert.deepEqual([key, rest], ["created-scenes", {}]);
  const { capacity } = fleet.spec.template.spec.counters[key];
  assert.ok(bufferSize > 0 && bufferSize <= minCapacity && minCapacity < maxCapacity); // Agones requires this
  for (const number of [bufferSize, minCapacity, maxCapacity]) assert.equal(number % capacity, 0); // whole servers
});

testAgones("the backend may only allocate servers of the fleet", (fleet, objects) => {
  const backend = named(objects, "Deployment", "clothstream-backend");
  const binding = named(objects, "RoleBinding", "clothstream-backend");
  const { namespace } = backend.metadata;
  assert.deepEqual(named(objects, binding.roleRef.kind, binding.roleRef.name).rules, [
    { apiGroups: ["allocation.agones.dev"], resources: ["gameserverallocations"], verbs: ["create"] },
  ]);
  assert.deepEqual(binding.subjects, [{ kind: "ServiceAccount", name: podOf(backend).serviceAccountName, namespace }]);
  assert.deepEqual(ofKind(objects, "Role").length + ofKind(objects, "ClusterRole").length, 1);
  assert.deepEqual(backend.spec.replicas, 1);
  const [container] = podOf(backend).containers;
  const args = container.args.map((arg) => expand(arg, environmentOf(objects, container)));
  const option = (name) => args.find((arg) => arg.startsWith(`--${name}=`))?.slice(name.length + 3);
  assert.deepEqual([option("fleet"), option("namespace")], [fleet.metadata.name, namespace]);
  const domain = environmentOf(objects, podOf(fleet).containers[0]).NODE_DOMAIN;
  assert.equal(option("address"), `https://{node}.${domain}:{port}`);
  assert.equal(podOf(backend).securityContext.runAsUser, Number(/^USER (\d+)/m.exec(read("deploy/backend/Containerfile"))[1]));
  const known = /const kDefaults = \{.*?^\};/ms.exec(read("deploy/backend/backend.mjs"))[0];
  for (const arg of args) assert.match(known, new RegExp(`[ "]${/^--([\w-]+)=/.exec(arg)[1]}"?: "`));
});

function natsConfiguration(objects) {
  const volume = podOf(named(objects, "StatefulSet", "clothstream-nats")).volumes.find(({ configMap }) => configMap);
  return named(objects, "ConfigMap", volume.configMap.name).data["nats.conf"];
}

testEach("servers and edges know NATS, and its servers each other", (objects) => {
  const nats = objects.find((object) => nameOf(object) === "StatefulSet clothstream-nats");
  if (!nats) return;
  for (const workload of workloads(objects)) {
    const [container] = podOf(workload).containers;
    if (!isOurs(container)) continue;
    const { protocol, hostname, port } = new URL(environmentOf(objects, container).CLOTHSTREAM_NATS);
    assert.equal(protocol, "tls:");
    const service = named(objects, "Service", hostname);
    assert.deepEqual(selected(objects, { matchLabels: service.spec.selector }, nameOf(service)), [nats]);
    assert.deepEqual(
      service.spec.ports.map((entry) => entry.port),
      [Number(port)],
    );
  }
  const text = natsConfiguration(objects);
  const ports = Object.fromEntries(podOf(nats).containers[0].ports.map(({ name, containerPort }) => [name, containerPort]));
  const routes = [...text.matchAll(/^ +(tls:\S+)$/gm)].map((match) => match[1]);
  assert.deepEqual(
    routes,
    Array.from({ length: nats.spec.replicas }, (_, i) => `tls://${nats.metadata.name}-${i}.${nats.spec.serviceName}:${ports.routes}`),
  );
  const [client, cluster] = [...text.matchAll(/^ *port: (\d+)/gm)].map((match) => Number(match[1]));
  assert.deepEqual([client, cluster, Number(/^http_port: (\d+)/m.exec(text)[1])], [ports.nats, ports.routes, ports.monitor]);
});

// Subjects that each user of NATS may use, from the table of the documentation.
function documentedUsers() {
  const users = /^\| subject \| (.*) \|$/m.exec(documentation)[1].split(" | ");
  const buckets = [.../^`BUCKET` is each of (.*?)\.$/ms.exec(documentation)[1].matchAll(/`([\w-]+)`/g)].map((match) => match[1]);
  assert.deepEqual([users, buckets.length], [["server", "edge", "operator"], 3]);
  const found = Object.fromEntries(users.map((user) => [user, { publish: [], subscribe: [] }]));
  for (const [, subject, cells] of documentation.matchAll(/^\| `((?:clothstream\.|\$)\S+)` \|(.*)\|$/gm))
    cells.split("|").forEach((cell, i) => {
      const own = users[i] === "server" ? buckets : buckets.slice(0, 2);
      const subjects = subject.includes("BUCKET") ? own.map((bucket) => subject.replaceAll("BUCKET", bucket)) : [subject];
      for (const right of cell.trim().split(", ").filter(Boolean)) found[users[i]][right].push(...subjects);
    });
  return found;
}

test("the example of nsc has the permissions of the table", () => {
  const [, example] = /^nsc add user --account clothstream --name edge (.*?)^nsc/ms.exec(documentation);
  const listed = (right) => [...example.matchAll(new RegExp(`--allow-${right} '(.*?)'`, "g"))].flatMap((match) => match[1].split(","));
  const { publish, subscribe } = documentedUsers().edge;
  assert.deepEqual([listed("pub").sort(), listed("sub").sort()], [publish.sort(), subscribe.sort()]);
});

// Variables for programs of this build, without options and without the user's files.
const programEnvironment = () => ({ ...Object.fromEntries(Object.entries(process.env).filter(([name]) => !name.startsWith("CLOTHSTREAM_"))), HOME: folder });

const client = join(dirname(server), "clothstream");
// Runs `clothstream`, and returns what it printed.
async function clothstream(...args) {
  const { stdout } = await promisify(execFile)(client, args, { encoding: "utf8", env: programEnvironment() });
  return stdout;
}

const noNats = spawnSync("nats-server", ["--version"]).status === 0 ? false : "there is no nats-server";
test("servers, edge and operator use NATS with its configuration and the permissions", { skip: noNats }, async (t) => {
  const [, options] = /^nsc edit account --name clothstream (.*)$/m.exec(documentation);
  const limits = [...options.matchAll(/--js-([\w-]+) (-?\d+)/g)].map(([, name, value]) => [name.replaceAll("-", "_"), Number(value)]);
  assert.deepEqual(limits.map(([name]) => name).sort(), ["consumer", "disk_storage", "mem_storage", "streams"]);
  const { configuration, credentials } = makeAccounts(Object.fromEntries(limits), documentedUsers());
  const files = {};
  for (const [user, text] of Object.entries(credentials)) {
    files[user] = join(folder, `${user}.creds`);
    await writeFile(files[user], text, { mode: 0o600 });
  }
  await withCluster(natsConfiguration(builds["overlays/fleet"]), configuration, join(folder, "nats"), async (cluster) => {
    const { greeting, urls, authority, get, log } = cluster;
    assert.deepEqual([greeting.tls_required, greeting.auth_required, greeting.connect_urls, greeting.jetstream], [true, true, undefined, true]);
    assert.ok(greeting.max_payload >= 1e6);
    if (!existsSync(client)) return t.diagnostic("there is no program clothstream");

    const as = (user) => ["--nats", urls.join(","), "--nats-credentials", files[user], "--nats-ca", authority];
    const processes = [];
    const start = async (user, ...args) => {
      const ports = ["--port=0", "--grpc-port=0"];
      const child = startProcess(server, [...args, ...ports, "--state-dir", "", "--announce=off", ...as(user)], programEnvironment());
      processes.push(child);
      const endpoint = () => /^gRPC +(\S+)$/m.exec(child.log)?.[1];
      await until(`the ${user} starts`, async () => endpoint() !== undefined, () => child.log);
      return endpoint();
    };
    const logs = () => [log(), ...processes.map((child) => child.log)].join("\n");
    const directory = async () => JSON.parse(await clothstream("list", "--json", ...as("operator")));
    const entryOf = async (name) => (await directory()).scenes.find(({ scene }) => scene === name);
    const ownerOf = async (name) => (await entryOf(name)).server;
    try {
      const origin = await start("server", "--scene=flag");
      await start("server", "--scene=swing");
      const edge = await start("edge", "edge");
      await clothstream("create", "--named", "swing", "--name", "mine", "--server", origin);
      await until("the directory has servers and scenes", async () => {
        const { servers, scenes } = await directory();
        return servers.length === 2 && scenes.map(({ scene }) => scene).sort().join() === "flag,mine,swing";
      }, logs);
      // A participant and a viewer on the edge stay while the scene moves.
      const visits = ["participant", "viewer"].map((role) =>
        clothstream("join", edge, "--scene", "mine", "--role", role, "--seconds", "8", "--no-reconnect", "--hash", "--json"),
      );
      await until("the participant is in the directory", async () => (await directory()).servers.some(({ participants }) => participants === 1), logs);
      const first = await ownerOf("mine");
      await clothstream("move", "mine", ...as("operator"));
      const second = await ownerOf("mine");
      assert.notEqual(first, second);
      for (const { frames, hashMismatches } of (await Promise.all(visits)).map((text) => JSON.parse(text))) {
        assert.ok(frames > 0);
        assert.equal(hashMismatches, 0);
      }
      await until("the scene has a checkpoint", async () => (await entryOf("mine")).checkpointTick > 0, logs);
      // When its server is lost, the other one continues the scene.
      processes[first === (await ownerOf("flag")) ? 1 : 0].kill("SIGKILL");
      await until("the other server has the scene", async () => (await ownerOf("mine")) === first, logs);

      // A server that catches up with the others does not list its streams.
      let streams = [];
      await until("NATS lists the buckets", async () => {
        const { account_details: accounts } = await get(0, "/jsz?streams=true&config=true");
        streams = (accounts ?? []).flatMap(({ stream_detail: details }) => details ?? []);
        return streams.length === 3;
      }, logs);
      assert.deepEqual(
        streams.map(({ name, config }) => [name, config.num_replicas, config.storage]).sort(),
        ["checkpoints", "scenes", "servers"].map((name) => [`KV_clothstream-${name}`, 3, "file"]),
      );
      for (const child of processes.filter(({ signalCode }) => signalCode === null)) {
        child.kill();
        await until("the program ends", async () => child.exitCode !== null, logs);
      }
      assert.deepEqual(logs().match(/^.*violation.*$/gim), null);
      // An edge has no rights in the directory.
      await assert.rejects(clothstream("list", "--json", ...as("edge")));
      assert.match(log(), /Publish Violation.*\$JS\.API/);
    } finally {
      for (const child of processes) child.kill("SIGKILL");
    }
  });
});
