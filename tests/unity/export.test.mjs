// SPDX-License-Identifier: MIT
// The export of cloth from Unity, with mono and a stub of the engine: scenes show what Unity shows, their fields are those of
// scene.proto, and the server accepts and moves them. About six seconds of one core, most of them for the compiler.
//
// Environment: CLOTHSTREAM_SERVER.

import assert from "node:assert/strict";
import { execFile, execFileSync } from "node:child_process";
import { mkdtemp, readdir, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";

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
const root = join(here, "../..");
// Unity accepts more, mono's compiler does not.
const kCompiler = ["-unsafe", "-debug", "-warnaserror", "-langversion:7"];
// Places are written in micrometres. Skinning adds a few of them, and single precision of the engine 1e-6 of 2 m.
const kTolerance = 1e-5;

let folder, skirt, bare, flag, expected;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "clothstream-export-"));
  const conversion = await compile("ClothStream.Export.dll", join(root, "clients/unity/Editor/Export"));
  const engine = await compile("UnityEngine.dll", join(here, "engine"));
  const references = [`-r:${conversion}`, `-r:${engine}`];
  const editor = await compile("ClothStream.Editor.dll", join(root, "clients/unity/Editor/Unity"), references);
  const program = await compile("ExportProgram.exe", join(here, "export"), [...references, `-r:${editor}`]);
  await run("mono", ["--debug", program, folder]);
  [skirt, bare, flag, expected] = await Promise.all(
    ["skirt", "bare", "flag", "expected"].map(async (name) => JSON.parse(await readFile(join(folder, `${name}.json`), "utf8"))),
  );
});

after(() => rm(folder, { recursive: true }));

// Compiles all C# of a folder, and returns the path of the result.
async function compile(name, from, options = []) {
  const sources = (await readdir(from)).filter((file) => file.endsWith(".cs")).map((file) => join(from, file));
  const out = join(folder, name);
  await run("mcs", [...kCompiler, ...(name.endsWith(".dll") ? ["-target:library"] : []), ...options, `-out:${out}`, ...sources]);
  return out;
}

const vector = ({ x = 0, y = 0, z = 0 } = {}) => [x, y, z];
const rotation = ({ x = 0, y = 0, z = 0, w = 0 } = { w: 1 }) => [x, y, z, w];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const plus = (a, b) => a.map((value, i) => value + b[i]);
const times = (a, factor) => a.map((value) => value * factor);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

function turned([x, y, z, w], point) {
  const twice = times(cross([x, y, z], point), 2);
  return plus(plus(point, times(twice, w)), cross([x, y, z], twice));
}

const placed = ({ position, orientation }, point) => plus(vector(position), turned(rotation(orientation), point));
function placedBack({ position, orientation }, point) {
  const [x, y, z, w] = rotation(orientation);
  return turned([-x, -y, -z, w], plus(point, times(vector(position), -1)));
}

// Maps from the frames of joints to that of the collider, as functions of points, from poses relative to their parents.
function maps(joints, poses, apply) {
  const chain = (joint, point) => {
    const { parent } = joints[joint];
    if (apply === placed) return parent === undefined ? placed(poses[joint], point) : chain(parent, placed(poses[joint], point));
    return placedBack(poses[joint], parent === undefined ? point : chain(parent, point));
  };
  return joints.map((_, joint) => (point) => chain(joint, point));
}

// Linear blend skinning of scene.proto: places of vertices with joints in these poses.
function skinned(positions, { vertexJoints, vertexWeights }, joints, poses) {
  const rest = joints.map((joint) => joint.rest);
  const toJoint = maps(joints, rest, placedBack);
  const fromJoint = maps(joints, poses, placed);
  return Array.from({ length: positions.length / 3 }, (_, vertex) => {
    const point = positions.slice(3 * vertex, 3 * vertex + 3);
    return [0, 1, 2, 3].reduce(
      (sum, i) => {
        const joint = vertexJoints[4 * vertex + i];
        return plus(sum, times(fromJoint[joint](toJoint[joint](point)), vertexWeights[4 * vertex + i]));
      },
      [0, 0, 0],
    );
  });
}

// Unity's numbers are left-handed: z has the other sign.
function isAt(points, unity, what) {
  assert.equal(unity.length, 3 * points.length);
  points.forEach((point, i) => {
    const goal = [unity[3 * i], unity[3 * i + 1], -unity[3 * i + 2]];
    const away = Math.hypot(...plus(point, times(goal, -1)));
    assert.ok(away < kTolerance, `${what}, ${i}: ${point} is ${away} m from ${goal}`);
  });
}

const colliderOf = (scene, name) => scene.colliders.find((collider) => collider.name === name);

test("cloth, body and colliders are where Unity shows them, at rest and in each key of the animation", () => {
  const { mesh: cloth, skin } = skirt.cloths[0];
  const { mesh: body } = colliderOf(skirt, "figure");
  const { joints, animation } = body.skin;
  assert.deepEqual(joints.map(({ name, parent }) => [name, parent]), [["Hips", undefined], ["Leg", 0]]);
  const [bound, ...frames] = expected;
  const rest = joints.map((joint) => joint.rest);
  isAt(skinned(cloth.positions, skin, joints, rest), bound.cloth, "cloth at rest");
  isAt(skinned(body.positions, body.skin, joints, rest), bound.body, "body at rest");
  const [leg, thigh] = skirt.colliders.slice(1);
  const ends = ({ capsule: { length } }, pose) => [-1, 1].map((side) => placed(pose, [0, (side * length) / 2, 0]));
  isAt([...ends(leg, leg.pose), ...ends(thigh, thigh.pose)], bound.ends, "colliders at rest");

  assert.deepEqual(animation.keys.map((key) => key.time), [0, 0.25, 0.5, 0.75, 1]);
  animation.keys.forEach((key, i) => {
    isAt(skinned(cloth.positions, skin, joints, key.joints), frames[i].cloth, `cloth at ${key.time} s`);
    isAt(skinned(body.positions, body.skin, joints, key.joints), frames[i].body, `body at ${key.time} s`);
    isAt([...ends(leg, leg.motion.keys[i]), ...ends(thigh, thigh.motion.keys[i])], frames[i].ends, `colliders at ${key.time} s`);
  });
  assert.equal(leg.motion.steady, true);
  const moved = frames[4].cloth.map((value, i) => Math.abs(value - frames[0].cloth[i]));
  assert.ok(Math.max(...moved) > 0.2, "the animation moves the cloth");
});

test("fronts of triangles, texture coordinates and sizes are kept", () => {
  const { mesh } = skirt.cloths[0];
  const point = (vertex) => mesh.positions.slice(3 * vertex, 3 * vertex + 3);
  const middle = times(Array.from({ length: 36 }, (_, vertex) => point(vertex)).reduce(plus), 1 / 36);
  for (let i = 0; i < mesh.triangles.length; i += 3) {
    const [a, b, c] = mesh.triangles.slice(i, i + 3).map(point);
    const normal = cross(plus(b, times(a, -1)), plus(c, times(a, -1)));
    const out = plus(times(plus(plus(a, b), c), 1 / 3), times(middle, -1));
    out[1] = 0; // the tube is about an upright axis where it is bound
    assert.ok(dot(normal, out) > 0, `triangle ${i / 3} looks outwards`);
  }
  assert.deepEqual(mesh.uvs.slice(0, 6), [0, 0, 0.125, 0, 0.25, 0]);
  // The figure has the scale 1.5; capsule and spheres too.
  const [, leg, thigh, foot] = skirt.colliders;
  const near = (value, goal) => assert.ok(Math.abs(value - goal) < 1e-5, `${value} is not ${goal}`);
  near(leg.capsule.radius, 0.06);
  near(leg.capsule.length, 1.5 * 0.22);
  assert.equal(leg.capsule.topRadius, undefined);
  near(thigh.capsule.radius, 0.15);
  near(thigh.capsule.topRadius, 0.09);
  near(foot.sphere.radius, 0.075);
  assert.deepEqual(skirt.colliders.map((collider) => collider.name), ["figure", "leg_1", "hips_2", "foot_3"]);
});

test("each vertex has the limits of its coefficient", () => {
  const { skin } = skirt.cloths[0];
  const ring = (values, index) => new Set(values.slice(9 * index, 9 * index + 9));
  assert.deepEqual([0, 1, 2, 3].map((index) => [...ring(skin.maxDistances, index)]), [[-1], [0.2], [0.1], [0]]);
  assert.deepEqual([0, 1, 2, 3].map((index) => [...ring(skin.backstopDistances, index)]), [[-1], [0.02], [-1], [-1]]);
  const [radius] = ring(skin.backstopRadii, 1);
  assert.ok(radius > 1, "ten edges");
  assert.deepEqual([...ring(skin.backstopRadii, 0)], [-1]);
});

test("settings of the cloth become those of ClothStream", () => {
  const [cloth] = skirt.cloths;
  assert.equal(cloth.name, "skirt_1");
  assert.equal(cloth.friction, 0.5);
  assert.ok(Math.abs(cloth.damping - 1.053605) < 1e-6);
  assert.deepEqual(cloth.solver, { xpbd: {} });
  assert.deepEqual([cloth.tethers, bare.cloths[0].tethers], [{}, undefined]);
  // Area of a tube of eight sides, 0.2 kg/m^2, 32 nodes; the formula is in clients/unity/README.md.
  const mass = (0.2 * 8 * 2 * 0.15 * Math.sin(Math.PI / 8) * 0.7 * 1.5 * 1.5) / 32;
  const stiffness = (part) => (part * mass * 100) / (2 * (1 - part));
  assert.ok(Math.abs(cloth.structural.stiffness / stiffness(0.9) - 1) < 1e-4, `${cloth.structural.stiffness} N/m`);
  assert.ok(Math.abs(cloth.bend.stiffness / stiffness(0.25) - 1) < 1e-4, `${cloth.bend.stiffness} N/m`);
  // The external acceleration of 2 m/s^2 along z of Unity's world, in the frame of the figure, which is turned by 0.7.
  const { x, y, z } = skirt.environment.gravity;
  for (const [value, goal] of [[x, -2 * Math.sin(0.7)], [y, -9.81], [z, -2 * Math.cos(0.7)]]) assert.ok(Math.abs(value - goal) < 1e-5, `${value}, not ${goal}`);
  assert.deepEqual(bare.environment.gravity, { x: 0, y: 0, z: 0 });
  assert.deepEqual([bare.cloths[0].material, bare.cloths[0].damping, bare.cloths[0].structural], ["cotton", undefined, undefined]);
});

test("without a body, a small closed mesh at each joint carries the joints", () => {
  const { mesh } = colliderOf(bare, "figure");
  assert.equal(mesh.skin.joints.length, 2);
  assert.equal(mesh.positions.length, 3 * 4 * 2);
  const directed = new Set();
  for (let i = 0; i < mesh.triangles.length; ++i) directed.add(`${mesh.triangles[i]} ${mesh.triangles[i % 3 === 2 ? i - 2 : i + 1]}`);
  assert.equal(directed.size, mesh.triangles.length);
  for (const edge of directed) assert.ok(directed.has(edge.split(" ").reverse().join(" ")), `edge ${edge} has two triangles`);
  assert.equal(mesh.skin.animation, undefined);
  assert.equal(bare.colliders[1].motion, undefined);
  // A mesh without bones follows its object.
  assert.deepEqual(colliderOf(flag, "figure").mesh.skin.joints.map((joint) => joint.name), ["Flag"]);
  assert.deepEqual(flag.cloths[0].skin.maxDistances, [0, 0, -1]);
  assert.deepEqual(flag.cloths[0].skin.vertexWeights, [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
});

// Fields of the messages of scene.proto: type and whether they are repeated.
async function messagesOfProto() {
  const text = (await readFile(join(root, "proto/clothstream/v1/scene.proto"), "utf8")).replace(/\/\/.*$/gm, "");
  const messages = new Map();
  for (const [, name, body] of text.matchAll(/^message (\w+) \{(\}|.*?^\})/gms)) {
    const fields = new Map();
    for (const [, label, type, field] of body.matchAll(/(repeated |optional )?\b(\w+) (\w+) = \d+;/g))
      fields.set(field.replace(/_(\w)/g, (_, letter) => letter.toUpperCase()), { type, repeated: label === "repeated " });
    messages.set(name, fields);
  }
  return messages;
}

function checkMessage(messages, type, value, path) {
  const checkOne = (kind, one, at) => {
    if (messages.has(kind)) return checkMessage(messages, kind, one, at);
    assert.equal(typeof one, { string: "string", bool: "boolean" }[kind] ?? "number", `${at} is a ${kind}`);
    if (kind === "uint32") assert.ok(Number.isInteger(one) && one >= 0, `${at} is a whole number`);
  };
  for (const [name, content] of Object.entries(value)) {
    const field = messages.get(type).get(name);
    assert.ok(field, `${path}.${name} is a field of ${type}`);
    assert.equal(Array.isArray(content), field.repeated, `${path}.${name}`);
    if (field.repeated) content.forEach((one, i) => checkOne(field.type, one, `${path}.${name}[${i}]`));
    else checkOne(field.type, content, `${path}.${name}`);
  }
}

test("all fields are those of scene.proto", async () => {
  const messages = await messagesOfProto();
  assert.ok(messages.get("ClothSkin").get("vertexJoints").repeated);
  for (const scene of [skirt, bare, flag]) checkMessage(messages, "Scene", scene, scene.name);
  assert.throws(() => checkMessage(messages, "Scene", { cloth: [] }, "scene"), /scene\.cloth is a field of Scene/);
});

test("the server accepts the scenes, and moves the cloth with the bones", async () => {
  const { CLOTHSTREAM_SERVER: server } = process.env;
  for (const name of ["skirt", "bare", "flag"]) {
    const { stdout } = await run(server, ["print-scene", join(folder, `${name}.json`)], { maxBuffer: 1e8 });
    assert.equal(JSON.parse(stdout).cloths[0].skin.collider, "figure");
  }
  // The second key is at 0.25 s: 18 ticks of 1/72 s. The upper ring has the distance 0.
  const states = join(folder, "skirt.f32");
  await run(server, ["step", "--scene", join(folder, "skirt.json"), "--ticks", "18", "--every", "18", "--out", states]);
  const { shape } = JSON.parse(await readFile(`${states}.json`, "utf8"));
  assert.deepEqual(shape, [2, 32, 6]);
  const bytes = await readFile(states);
  const values = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4).slice(32 * 6);
  const nodes = Array.from({ length: 32 }, (_, node) => [...values.slice(6 * node, 6 * node + 3)]);
  const { cloth } = expected[2];
  for (let vertex = 27; vertex < 36; ++vertex) {
    const goal = [cloth[3 * vertex], cloth[3 * vertex + 1], -cloth[3 * vertex + 2]];
    const away = Math.min(...nodes.map((node) => Math.hypot(...plus(node, times(goal, -1)))));
    assert.ok(away < kTolerance, `vertex ${vertex} is ${away} m from its bones`);
  }
});
