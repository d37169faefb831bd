// SPDX-License-Identifier: MIT
// What `clothstream export` writes is read by three.js as glTF, and moves there as the OBJ files of the same frames do.
// Usage: node export.test.mjs CLOTHSTREAM RECORDING
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { AnimationMixer } from "../../clients/web/node_modules/three/build/three.module.js";
import { GLTFLoader } from "../../clients/web/node_modules/three/examples/jsm/loaders/GLTFLoader.js";

const [clothstream, recording] = process.argv.slice(2);
const directory = mkdtempSync(join(tmpdir(), "clothstream-"));
const [glb, objs] = [join(directory, "out.glb"), join(directory, "objs")];
const rate = 10;

const positionsOf = (obj) => [...obj.matchAll(/^v (\S+) (\S+) (\S+)$/gm)].flatMap((line) => line.slice(1).map(Number));

try {
  execFileSync(clothstream, ["export", recording, glb, "--rate", `${rate}`]);
  execFileSync(clothstream, ["export", recording, objs, "--rate", `${rate}`]);
  const frames = readdirSync(objs).sort().map((name) => positionsOf(readFileSync(join(objs, name), "utf8")));
  assert.equal(frames.length, 25);

  const bytes = readFileSync(glb);
  const gltf = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");

  // As text it is the same: its JSON but for where the numbers are, and the numbers.
  const text = join(directory, "out.gltf");
  execFileSync(clothstream, ["export", recording, text, "--rate", `${rate}`]);
  const { buffers, ...embedded } = JSON.parse(readFileSync(text, "utf8"));
  const jsonBytes = bytes.readUInt32LE(12);
  const { buffers: binary, ...json } = JSON.parse(bytes.toString("utf8", 20, 20 + jsonBytes));
  assert.deepEqual(embedded, json);
  assert.equal(buffers[0].byteLength, binary[0].byteLength);
  const numbers = Buffer.from(buffers[0].uri.replace("data:application/octet-stream;base64,", ""), "base64");
  assert.ok(numbers.equals(bytes.subarray(28 + jsonBytes, 28 + jsonBytes + binary[0].byteLength)));
  const meshes = [];
  gltf.scene.traverse((object) => object.isMesh && meshes.push(object));
  assert.ok(meshes.length > 0);
  const { geometry } = meshes[0];
  assert.equal(3 * geometry.attributes.position.count, frames[0].length);
  assert.equal(geometry.morphAttributes.position.length, frames.length - 1);
  assert.equal(gltf.animations.length, 1);
  const [clip] = gltf.animations;
  assert.ok(Math.abs(clip.duration - (frames.length - 1) / rate) < 0.02);

  const times = clip.tracks[0].times;
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(clip).play();
  for (const frame of [0, 1, 7, frames.length - 2]) {
    mixer.setTime(times[frame]);
    const shown = [...geometry.attributes.position.array];
    meshes[0].morphTargetInfluences.forEach((weight, target) => {
      const moved = geometry.morphAttributes.position[target].array;
      for (let i = 0; i < shown.length; ++i) shown[i] += weight * moved[i];
    });
    frames[frame].forEach((value, i) => assert.ok(Math.abs(shown[i] - value) < 1e-4, `frame ${frame}, number ${i}`));
  }

  const refused = (...options) => {
    const out = join(directory, "refused.glb");
    const ended = spawnSync(clothstream, ["export", recording, out, ...options], { encoding: "utf8" });
    assert.ok(!existsSync(out));
    return ended;
  };
  assert.match(refused("--from", "100").stderr, /has no frame in the requested time/);
  assert.equal(spawnSync(clothstream, ["export", recording, glb]).status, 6, "what is there is not overwritten");
} finally {
  rmSync(directory, { recursive: true, force: true });
}
