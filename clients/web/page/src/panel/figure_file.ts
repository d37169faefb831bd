// SPDX-License-Identifier: MIT
// Reads a glTF or GLB file as a figure: a mesh with joints, at rest, and an animation of the joints.

import * as THREE from "three";
import type { FigureJoint, FigureKey, FigurePose, SceneFigure } from "@clothstream/client";
import { readGltf } from "./mesh_file";

// Limits of the server (docs/colliders.md).
const kMostJoints = 128;
const kMostVertices = 60_000;
const kMostTriangles = 20_000;
const kMostKeys = 1024;
const kMostPoses = 16_384;
const kFramesPerSecond = 30;
const kScaleTolerance = 0.01;

export interface FileFigure extends SceneFigure {
  animation: string; // name of the clip; empty without a clip
}

// Throws an Error whose text is for people. The place of the figure is where viewers show it without animation.
export async function readFigure(file: File): Promise<FileFigure> {
  if (!/\.(glb|gltf)$/i.test(file.name)) throw new Error(`${file.name} is not a GLB or glTF file, so it has no joints.`);
  const { scene, animations } = await readGltf(file);
  scene.updateMatrixWorld(true);
  return figureOf(scene, animations, file.name);
}

// The figure of a scene whose world matrices are up to date.
export function figureOf(scene: THREE.Object3D, animations: readonly THREE.AnimationClip[], name: string): FileFigure {
  const meshes: THREE.SkinnedMesh[] = [];
  scene.traverse((object) => {
    if (object instanceof THREE.SkinnedMesh) meshes.push(object as THREE.SkinnedMesh);
  });
  const [first] = meshes;
  if (!first) throw new Error(`${name} has no mesh with a skin. Export the figure together with its skeleton.`);
  if (meshes.some((mesh) => mesh.skeleton !== first.skeleton)) throw new Error(`${name} has several skins. Join its meshes into one.`);
  const skeleton = new Skeleton(first.skeleton, name);
  const mesh = joined(meshes, skeleton, name);
  const clip = animations[0];
  return { ...mesh, joints: skeleton.joints(), keys: clip ? skeleton.keys(scene, clip) : [], animation: clip ? clip.name || "an animation" : "" };
}

class Skeleton {
  // Map of points of the mesh to the scene where the skeleton rests.
  readonly place: THREE.Matrix4;
  private readonly order: number[]; // bones in the order of joints: parents first
  private readonly parents: (number | undefined)[]; // of each joint
  private readonly rests: THREE.Matrix4[]; // of each joint in the scene

  constructor(
    private readonly skeleton: THREE.Skeleton,
    private readonly name: string,
  ) {
    const { bones, boneInverses } = skeleton;
    if (bones.length > kMostJoints) throw new Error(`${name} has ${bones.length} joints; at most ${kMostJoints} are possible.`);
    const depth = (object: THREE.Object3D): number => (object.parent ? depth(object.parent) + 1 : 0);
    this.order = [...bones.keys()].sort((a, b) => depth(bones[a]!) - depth(bones[b]!));
    const root = this.order[0]!;
    this.place = bones[root]!.matrixWorld.clone().multiply(boneInverses[root]!);
    this.parents = this.order.map((bone) => this.jointAbove(bones[bone]!.parent));
    this.rests = this.order.map((bone) => this.place.clone().multiply(boneInverses[bone]!.clone().invert()));
  }

  // Joint of a bone, by its index in the file.
  get jointOfBone(): Uint32Array {
    const joints = new Uint32Array(this.order.length);
    this.order.forEach((bone, joint) => (joints[bone] = joint));
    return joints;
  }

  joints(): FigureJoint[] {
    const poses = this.local(this.rests);
    return this.order.map((bone, joint) => ({ name: this.skeleton.bones[bone]!.name, parent: this.parents[joint], rest: poses[joint]! }));
  }

  // Samples a clip at a fixed rate, or at the highest rate that the server accepts.
  keys(scene: THREE.Object3D, clip: THREE.AnimationClip): FigureKey[] {
    const most = Math.min(kMostKeys, Math.floor(kMostPoses / this.order.length)) - 1;
    const steps = Math.max(1, Math.min(most, Math.round(clip.duration * kFramesPerSecond)));
    if (!(clip.duration > 0)) return [];
    const moves = clip.tracks.map((track) => moveOf(scene, track));
    return Array.from({ length: steps + 1 }, (_, step) => {
      const time = (clip.duration * step) / steps;
      for (const move of moves) move(time);
      scene.updateMatrixWorld(true);
      return { time, joints: this.local(this.order.map((bone) => this.skeleton.bones[bone]!.matrixWorld)) };
    });
  }

  private jointAbove(object: THREE.Object3D | null): number | undefined {
    for (let above = object; above; above = above.parent) {
      const bone = this.skeleton.bones.indexOf(above as THREE.Bone);
      if (bone >= 0) return this.order.indexOf(bone);
    }
    return undefined;
  }

  // Poses relative to the parents. Joints have no scale.
  private local(matrices: readonly THREE.Matrix4[]): FigurePose[] {
    const rigid = matrices.map((matrix, joint) => this.rigid(matrix, joint));
    return rigid.map((matrix, joint) => {
      const parent = this.parents[joint];
      const local = parent === undefined ? matrix : rigid[parent]!.clone().invert().multiply(matrix);
      const [position, turn] = [new THREE.Vector3(), new THREE.Quaternion()];
      local.decompose(position, turn, new THREE.Vector3());
      return { position: position.toArray(), orientation: [turn.x, turn.y, turn.z, turn.w] };
    });
  }

  private rigid(matrix: THREE.Matrix4, joint: number): THREE.Matrix4 {
    const [position, turn, scale] = [new THREE.Vector3(), new THREE.Quaternion(), new THREE.Vector3()];
    matrix.decompose(position, turn, scale);
    const isEven = Math.abs(scale.y / scale.x - 1) < kScaleTolerance && Math.abs(scale.z / scale.x - 1) < kScaleTolerance;
    if (!(scale.x > 0) || !isEven)
      throw new Error(`${this.name}: the joint ${this.skeleton.bones[this.order[joint]!]!.name} is mirrored, or scaled differently along its axes. Apply its scale.`);
    return new THREE.Matrix4().compose(position, turn, new THREE.Vector3(1, 1, 1));
  }
}

// Sets a property of the node of a track to its value at a time. AnimationMixer would add 4 kB to the page.
function moveOf(scene: THREE.Object3D, track: THREE.KeyframeTrack): (time: number) => void {
  const { nodeName, propertyName } = THREE.PropertyBinding.parseTrackName(track.name);
  const node = THREE.PropertyBinding.findNode(scene, nodeName) as THREE.Object3D | null;
  if (!node || !(propertyName === "position" || propertyName === "quaternion" || propertyName === "scale")) return () => undefined;
  const interpolant = (track as unknown as { createInterpolant(): THREE.Interpolant }).createInterpolant();
  return (time) => void node[propertyName].fromArray(Array.from(interpolant.evaluate(time)));
}

type FigureMesh = Pick<SceneFigure, "positions" | "triangles" | "vertexJoints" | "vertexWeights">;

// All meshes of a figure as one, in the scene.
function joined(meshes: readonly THREE.SkinnedMesh[], skeleton: Skeleton, name: string): FigureMesh {
  const { jointOfBone } = skeleton;
  const [positions, triangles, vertexJoints, vertexWeights]: [number[], number[], number[], number[]] = [[], [], [], []];
  const point = new THREE.Vector3();
  for (const { geometry } of meshes) {
    const attribute = (kind: string) => {
      const found = geometry.getAttribute(kind);
      if (!found) throw new Error(`${name} has a mesh without weights. Bind all of the figure to its skeleton.`);
      return found;
    };
    const [places, indices, weights] = [attribute("position"), attribute("skinIndex"), attribute("skinWeight")];
    const first = positions.length / 3;
    if (first + places.count > kMostVertices) throw new Error(`${name} has more than ${kMostVertices.toLocaleString("en")} vertices. Simplify it.`);
    for (let vertex = 0; vertex < places.count; ++vertex) {
      positions.push(...point.fromBufferAttribute(places, vertex).applyMatrix4(skeleton.place).toArray());
      const four = [0, 1, 2, 3].map((i) => weights.getComponent(vertex, i));
      const sum = four.reduce((a, b) => a + b, 0);
      if (!(sum > 0)) throw new Error(`${name} has a vertex without weights. Bind all of the figure to its skeleton.`);
      for (let i = 0; i < 4; ++i) {
        vertexJoints.push(four[i]! > 0 ? (jointOfBone[indices.getComponent(vertex, i)] ?? 0) : 0);
        vertexWeights.push(four[i]! / sum);
      }
    }
    const count = geometry.index ? geometry.index.count : places.count;
    for (let i = 0; i < count; ++i) triangles.push(first + (geometry.index ? geometry.index.getX(i) : i));
  }
  if (triangles.length / 3 > kMostTriangles) throw new Error(`${name} has more than ${kMostTriangles.toLocaleString("en")} triangles. Simplify it.`);
  return {
    positions: Float32Array.from(positions),
    triangles: Uint32Array.from(triangles),
    vertexJoints: Uint32Array.from(vertexJoints),
    vertexWeights: Float32Array.from(vertexWeights),
  };
}
