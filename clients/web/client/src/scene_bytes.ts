// SPDX-License-Identifier: MIT
// Writes the definition of a scene with one cloth from a mesh, as a serialised Scene of scene.proto.

import {
  ClothFields,
  ClothSkinFields,
  ColliderFields,
  ColliderMeshFields,
  JointAnimationFields,
  JointFields,
  JointKeyFields,
  MeshFields,
  PoseFields,
  QuaternionFields,
  SceneFields,
  SkinFields,
  Vec3Fields,
} from "./tables";

export interface MeshScene {
  name: string; // 1 to 64 characters out of [a-z0-9_-]; also the name of the cloth
  description: string;
  positions: Float32Array; // 3 per vertex, in units of `scale`
  triangles: Uint32Array; // 3 vertex indices each
  uvs?: Float32Array; // 2 per vertex
  scale: number; // metres per unit
  position: readonly [number, number, number]; // of the mesh in the scene, m
  material: string; // "" means none
  massPerArea?: number; // kg/m^2; undefined: that of the material
  pinned: ArrayLike<number>; // vertex indices
  repair: boolean; // whether the server repairs a mesh that it would refuse (docs/meshes.md)
  fit: boolean; // whether the server scales a mesh that does not fit the world
  selfCollision: boolean;
  floor: boolean; // a plane at y = 0
  // Figure that the cloth follows, and how far vertices may leave their places on it. The mesh is then in the frame of
  // the figure at rest.
  figure?: SceneFigure;
  limits?: SkinLimitLists;
}

// Collider with joints. Lengths are in units of MeshScene.scale.
export interface SceneFigure {
  positions: Float32Array; // 3 per vertex
  triangles: Uint32Array;
  joints: readonly FigureJoint[]; // parents first
  vertexJoints: Uint32Array; // 4 per vertex
  vertexWeights: Float32Array;
  keys: readonly FigureKey[]; // of the animation; none: the joints rest
}

export interface FigurePose {
  position: readonly number[];
  orientation: readonly number[]; // x y z w
}

export interface FigureJoint {
  name: string;
  parent: number | undefined;
  rest: FigurePose; // relative to the parent
}

export interface FigureKey {
  time: number; // s
  joints: readonly FigurePose[];
}

// A number for each vertex of the cloth, metres. Negative: no limit.
export interface SkinLimitLists {
  maxDistances?: Float32Array;
  backstopDistances?: Float32Array;
  backstopRadii?: Float32Array;
}

const kFigure = "figure"; // name of its collider

// Each part is bytes. A message is the concatenation of its fields.
type Part = Uint8Array;

export function sceneBytes(scene: MeshScene): Uint8Array {
  const mesh = joined([
    bytes(MeshFields.positions, view(scene.positions)),
    bytes(MeshFields.triangles, packed(scene.triangles)),
    ...(scene.uvs ? [bytes(MeshFields.uvs, view(scene.uvs))] : []),
    bytes(MeshFields.pose, bytes(PoseFields.position, vec3(scene.position))),
    float(MeshFields.scale, scene.scale),
    ...(scene.repair ? [flag(MeshFields.repair)] : []),
    ...(scene.fit ? [flag(MeshFields.fit)] : []),
  ]);
  const cloth = joined([
    text(ClothFields.name, scene.name),
    bytes(ClothFields.mesh, mesh),
    ...(scene.pinned.length > 0 ? [bytes(ClothFields.pinnedVertices, packed(scene.pinned))] : []),
    ...(scene.selfCollision ? [bytes(ClothFields.selfCollision, new Uint8Array())] : []),
    ...(scene.material ? [text(ClothFields.material, scene.material)] : []),
    ...(scene.massPerArea === undefined ? [] : [float(ClothFields.arealMass, scene.massPerArea)]),
    ...(scene.figure ? [bytes(ClothFields.skin, clothSkin(scene.limits ?? {}))] : []),
  ]);
  const floor = joined([text(ColliderFields.name, "floor"), bytes(ColliderFields.plane, new Uint8Array())]);
  return joined([
    text(SceneFields.name, scene.name),
    text(SceneFields.description, scene.description),
    bytes(SceneFields.cloths, cloth),
    ...(scene.floor ? [bytes(SceneFields.colliders, floor)] : []),
    ...(scene.figure ? [bytes(SceneFields.colliders, figureCollider(scene.figure, scene.scale))] : []),
  ]);
}

// The server finds the joints of the cloth at the nearest points of the figure.
function clothSkin({ maxDistances, backstopDistances, backstopRadii }: SkinLimitLists): Part {
  const list = (field: number, values: Float32Array | undefined) => (values ? [bytes(field, view(values))] : []);
  return joined([
    text(ClothSkinFields.collider, kFigure),
    ...list(ClothSkinFields.maxDistances, maxDistances),
    ...list(ClothSkinFields.backstopDistances, backstopDistances),
    ...list(ClothSkinFields.backstopRadii, backstopRadii),
  ]);
}

function figureCollider(figure: SceneFigure, scale: number): Part {
  // The poses of joints are in metres.
  const pose = ({ position, orientation }: FigurePose) =>
    joined([
      bytes(PoseFields.position, vec3([scale * position[0]!, scale * position[1]!, scale * position[2]!])),
      bytes(PoseFields.orientation, quaternion(orientation)),
    ]);
  const joints = figure.joints.map(({ name, parent, rest }) =>
    joined([text(JointFields.name, name), ...(parent === undefined ? [] : [packed([8 * JointFields.parent, parent])]), bytes(JointFields.rest, pose(rest))]),
  );
  const keys = figure.keys.map(({ time, joints: poses }) =>
    bytes(JointAnimationFields.keys, joined([float(JointKeyFields.time, time), ...poses.map((one) => bytes(JointKeyFields.joints, pose(one)))])),
  );
  const skin = joined([
    ...joints.map((joint) => bytes(SkinFields.joints, joint)),
    bytes(SkinFields.vertexJoints, packed(figure.vertexJoints)),
    bytes(SkinFields.vertexWeights, view(figure.vertexWeights)),
    ...(keys.length > 0 ? [bytes(SkinFields.animation, joined(keys))] : []),
  ]);
  const mesh = joined([
    bytes(ColliderMeshFields.positions, view(figure.positions)),
    bytes(ColliderMeshFields.triangles, packed(figure.triangles)),
    float(ColliderMeshFields.scale, scale),
    bytes(ColliderMeshFields.skin, skin),
  ]);
  return joined([text(ColliderFields.name, kFigure), bytes(ColliderFields.mesh, mesh)]);
}

function quaternion([x, y, z, w]: readonly number[]): Part {
  const { x: fieldX, y: fieldY, z: fieldZ, w: fieldW } = QuaternionFields;
  return joined([float(fieldX, x!), float(fieldY, y!), float(fieldZ, z!), float(fieldW, w!)]);
}

function vec3([x, y, z]: readonly [number, number, number]): Part {
  return joined([float(Vec3Fields.x, x), float(Vec3Fields.y, y), float(Vec3Fields.z, z)]);
}

function text(field: number, value: string): Part {
  return bytes(field, new TextEncoder().encode(value));
}

function bytes(field: number, value: Uint8Array): Part {
  return joined([packed([8 * field + 2, value.length]), value]);
}

function float(field: number, value: number): Part {
  const part = new Uint8Array(4);
  new DataView(part.buffer).setFloat32(0, value, true);
  return joined([packed([8 * field + 5]), part]);
}

function flag(field: number): Part {
  return packed([8 * field, 1]);
}

// Bytes of the floats. All machines with a browser are little-endian, like the format.
function view(values: Float32Array): Part {
  return new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
}

// Varints, one after the other.
export function packed(values: ArrayLike<number>): Part {
  const out = new Uint8Array(5 * values.length);
  let end = 0;
  for (let i = 0; i < values.length; ++i) {
    let value = values[i]!;
    for (; value >= 0x80; value = Math.floor(value / 0x80)) out[end++] = (value % 0x80) + 0x80;
    out[end++] = value;
  }
  return out.subarray(0, end);
}

function joined(parts: readonly Part[]): Part {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let end = 0;
  for (const part of parts) {
    out.set(part, end);
    end += part.length;
  }
  return out;
}
