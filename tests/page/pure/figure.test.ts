// SPDX-License-Identifier: MIT
// Limits that are painted on the vertices of a cloth, and figures that are read from files.

import * as THREE from "three";
import { assert, test } from "vitest";
import { figureOf } from "../../../clients/web/page/src/panel/figure_file";
import { hueOf, kNoLimit, largestOf, legendOf } from "../../../clients/web/page/src/panel/limit_colours";
import { VertexNumbers } from "../../../clients/web/page/src/panel/vertex_numbers";

test("strokes give vertices numbers, and are undone one by one", () => {
  const limits = new VertexNumbers(4, kNoLimit);
  assert.equal(limits.paint([0], 1), false, "there is no stroke");
  limits.begin();
  assert.equal(limits.paint([0, 1], 0.1), true);
  assert.equal(limits.paint([0, 1], 0.1), false, "they have this number already");
  limits.paint([1], 0.5);
  assert.equal(limits.end(), true);
  limits.begin();
  assert.equal(limits.end(), false, "a stroke without changes is no step");
  limits.begin();
  limits.paint([1, 2], kNoLimit);
  limits.end();
  assert.deepEqual([...limits.values], [Math.fround(0.1), -1, -1, -1]);
  limits.undo();
  assert.deepEqual([...limits.values], [Math.fround(0.1), 0.5, -1, -1]);
  limits.begin();
  limits.paint([3], 2);
  limits.cancel();
  limits.undo();
  assert.deepEqual([...limits.values], [-1, -1, -1, -1]);
  assert.equal(limits.canUndo, false);
});

test("colours go from red for 0 to blue for the largest limit, and the legend says so", () => {
  const limits = Float32Array.from([0, kNoLimit, 0.25, 0.125]);
  assert.equal(largestOf(limits), 0.25);
  assert.equal(hueOf(0, 0.25), 0);
  assert.equal(hueOf(0.125, 0.25), hueOf(0.25, 0.25) / 2);
  assert.equal(hueOf(0, 0), 0);
  assert.equal(legendOf(limits, "unbounded"), "Red: 0 m, blue: 0.25 m, grey: unbounded.");
  assert.equal(legendOf(Float32Array.from([0, -1]), "unbounded"), "Red: 0 m, grey: unbounded.");
  assert.match(legendOf(Float32Array.from([-1, -1]), "no backstop"), /no backstop everywhere/);
});

// A triangle whose corners hang on two bones. The file lists the child first, and has a node with a scale above both.
function figure() {
  const [armature, hips, leg] = [new THREE.Group(), new THREE.Bone(), new THREE.Bone()];
  armature.add(hips);
  hips.add(leg);
  armature.scale.setScalar(0.01);
  armature.rotation.x = -Math.PI / 2;
  hips.name = "hips";
  hips.position.set(0, 0, 100);
  leg.name = "leg";
  leg.position.set(0, 0, -40);
  leg.rotation.y = 0.5;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from([0, 0, 100, 10, 0, 60, 0, 10, 20]), 3));
  geometry.setAttribute("skinIndex", new THREE.BufferAttribute(Uint16Array.from([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]), 4));
  geometry.setAttribute("skinWeight", new THREE.BufferAttribute(Float32Array.from([1, 0, 0, 0, 0.5, 0.25, 0, 0, 1, 0, 0, 0]), 4));
  const mesh = new THREE.SkinnedMesh(geometry);
  armature.add(mesh);
  const scene = new THREE.Group();
  scene.add(armature);
  scene.updateMatrixWorld(true);
  // Bound in the frame of the armature, as files of modelling tools are.
  const skeleton = new THREE.Skeleton([leg, hips], [leg, hips].map((bone) => armature.matrixWorld.clone().invert().multiply(bone.matrixWorld).invert()));
  mesh.bind(skeleton, new THREE.Matrix4());
  return { scene, mesh, hips, leg };
}

const near = (values: ArrayLike<number>, goal: readonly number[]) => {
  assert.equal(values.length, goal.length);
  goal.forEach((value, i) => assert.closeTo(values[i]!, value, 1e-6));
};

test("a figure is where viewers show it, with parents before children", () => {
  const { scene } = figure();
  const read = figureOf(scene, [], "figure.glb");
  near(read.positions, [0, 1, 0, 0.1, 0.6, 0, 0, 0.2, -0.1]);
  assert.deepEqual([...read.triangles], [0, 1, 2]);
  assert.deepEqual(read.joints.map(({ name, parent }) => [name, parent]), [["hips", undefined], ["leg", 0]]);
  // The armature turns z up to y up, and its scale is in the positions.
  near(read.joints[0]!.rest.position, [0, 1, 0]);
  near(read.joints[1]!.rest.position, [0, 0, -0.4]);
  near(read.joints[1]!.rest.orientation, [0, Math.sin(0.25), 0, Math.cos(0.25)]);
  assert.deepEqual([...read.vertexJoints], [0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  near(read.vertexWeights, [1, 0, 0, 0, 2 / 3, 1 / 3, 0, 0, 1, 0, 0, 0]);
  assert.deepEqual([read.keys, read.animation], [[], ""]);
});

test("an animation is sampled from its first to its last moment", () => {
  const { scene } = figure();
  const track = new THREE.VectorKeyframeTrack("hips.position", [0, 0.1], [0, 0, 100, 0, 0, 130]);
  const read = figureOf(scene, [new THREE.AnimationClip("walk", 0.1, [track])], "figure.glb");
  assert.equal(read.animation, "walk");
  near(read.keys.map((key) => key.time), [0, 1 / 30, 2 / 30, 0.1]);
  near(read.keys.map((key) => key.joints[0]!.position[1]!), [1, 1.1, 1.2, 1.3]);
  for (const key of read.keys) near(key.joints[1]!.position, [0, 0, -0.4]);
  // The rest is that of the file, not that of the animation.
  near(read.joints[0]!.rest.position, [0, 1, 0]);
});

test("what cannot be a figure is refused with what to do", () => {
  const refuses = (change: (made: ReturnType<typeof figure>) => void, reason: RegExp) => {
    const made = figure();
    change(made);
    made.scene.updateMatrixWorld(true);
    assert.throws(() => figureOf(made.scene, [], "a.glb"), reason);
  };
  refuses(({ mesh }) => mesh.removeFromParent(), /a\.glb has no mesh with a skin\. Export the figure together with its skeleton/);
  refuses(({ mesh }) => mesh.geometry.deleteAttribute("skinWeight"), /mesh without weights/);
  refuses(({ mesh }) => mesh.geometry.getAttribute("skinWeight").setXYZW(1, 0, 0, 0, 0), /vertex without weights/);
  refuses(({ scene, mesh, hips }) => {
    const other = mesh.clone();
    other.bind(new THREE.Skeleton([hips]), new THREE.Matrix4());
    scene.add(other);
  }, /several skins\. Join/);
  refuses(({ mesh, leg }) => (mesh.skeleton.boneInverses[mesh.skeleton.bones.indexOf(leg)] = new THREE.Matrix4().makeScale(1, 2, 1)), /the joint leg is mirrored, or scaled differently/);
  refuses(({ mesh }) => {
    const bones = Array.from({ length: 129 }, () => new THREE.Bone());
    mesh.bind(new THREE.Skeleton(bones), new THREE.Matrix4());
  }, /129 joints; at most 128/);
  refuses(({ mesh }) => mesh.geometry.setIndex(Array.from({ length: 60_003 }, () => 0)), /more than 20,000 triangles/);
});
