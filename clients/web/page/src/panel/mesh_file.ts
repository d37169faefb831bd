// SPDX-License-Identifier: MIT
// Reads an OBJ, glTF or GLB file as one mesh.

import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";

export interface FileMesh {
  positions: Float32Array; // 3 per vertex
  triangles: Uint32Array; // 3 indices each
  uvs: Float32Array | undefined; // 2 per vertex
}

const kMaxBytes = 64e6;
const kMaxVertices = 4e6;

// Throws an Error whose text is for people.
export async function readMesh(file: File): Promise<FileMesh> {
  const kind = /\.(obj|glb|gltf)$/i.exec(file.name)?.[1]?.toLowerCase();
  if (!kind) throw new Error(`${file.name} is not an OBJ, GLB or glTF file.`);
  if (file.size > kMaxBytes)
    throw new Error(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB; at most ${kMaxBytes / 1e6} MB are allowed.`);
  const root = kind === "obj" ? new OBJLoader().parse(await file.text()) : await readGltf(file);
  const parts: THREE.BufferGeometry[] = [];
  root.updateMatrixWorld(true);
  root.traverse((object) => {
    if (!(object instanceof THREE.Mesh)) return;
    const from = object.geometry as THREE.BufferGeometry;
    const part = new THREE.BufferGeometry();
    part.setAttribute("position", from.getAttribute("position").clone());
    if (from.hasAttribute("uv")) part.setAttribute("uv", from.getAttribute("uv").clone());
    if (from.index) part.setIndex(from.index.clone());
    parts.push(part.applyMatrix4(object.matrixWorld));
  });
  return merged(parts, file.name, kind !== "obj");
}

async function readGltf(file: File): Promise<THREE.Object3D> {
  try {
    const { scene } = await new GLTFLoader().parseAsync(await file.arrayBuffer(), "");
    return scene;
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    if (/DRACO/i.test(why)) throw new Error(`${file.name} is compressed with Draco. Export it without compression.`);
    if (/meshopt/i.test(why)) throw new Error(`${file.name} is compressed with meshopt. Export it without compression.`);
    if (/fetch|load|buffer/i.test(why))
      throw new Error(`${file.name} needs other files. Export it as GLB, which has everything in one file. (${why})`);
    throw new Error(`${file.name} cannot be read: ${why}`);
  }
}

// `vDown`: texture coordinates count v downwards, as in glTF. The server counts it upwards, like OBJ.
function merged(parts: THREE.BufferGeometry[], name: string, vDown: boolean): FileMesh {
  const positions: number[] = [];
  const triangles: number[] = [];
  const uvs: number[] = [];
  const hasUvs = parts.length > 0 && parts.every((part) => part.hasAttribute("uv"));
  for (let part of parts) {
    if (!hasUvs) part.deleteAttribute("uv");
    if (!part.index) part = mergeVertices(part, 0);
    const from = part.getAttribute("position");
    const first = positions.length / 3;
    if (first + from.count > kMaxVertices) throw new Error(`${name} has more than ${kMaxVertices.toLocaleString("en")} vertices.`);
    for (let i = 0; i < from.count; ++i) positions.push(from.getX(i), from.getY(i), from.getZ(i));
    if (hasUvs) {
      const uv = part.getAttribute("uv");
      for (let i = 0; i < uv.count; ++i) uvs.push(uv.getX(i), vDown ? 1 - uv.getY(i) : uv.getY(i));
    }
    for (let i = 0; i < part.index!.count; ++i) triangles.push(first + part.index!.getX(i));
  }
  if (triangles.length < 3) throw new Error(`${name} has no triangles.`);
  if (!positions.every(Number.isFinite)) throw new Error(`${name} has positions that are not numbers.`);
  return {
    positions: Float32Array.from(positions),
    triangles: Uint32Array.from(triangles),
    uvs: hasUvs ? Float32Array.from(uvs) : undefined,
  };
}
