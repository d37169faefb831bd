// SPDX-License-Identifier: MIT
// Reads an OBJ, glTF or GLB file as one mesh.

import * as THREE from "three";
import { DRACOLoader } from "three/examples/jsm/loaders/DRACOLoader.js";
import { GLTFLoader, type GLTF } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { checkGltf } from "./gltf_header";

export interface FileMesh {
  positions: Float32Array; // 3 per vertex
  triangles: Uint32Array; // 3 indices each
  uvs: Float32Array | undefined; // 2 per vertex
}

// Decoder of Draco from the package three. The page loads it for the first file that needs it.
const kDraco = { js: new URL("./draco_decoder.js", import.meta.url), wasm: new URL("./draco_decoder.wasm", import.meta.url) };
const kMaxBytes = 64e6;
const kMaxVertices = 4e6;

// Throws an Error whose text is for people.
export async function readMesh(file: File): Promise<FileMesh> {
  const kind = /\.(obj|glb|gltf)$/i.exec(file.name)?.[1]?.toLowerCase();
  if (!kind) throw new Error(`${file.name} is not an OBJ, GLB or glTF file.`);
  checkSize(file);
  const root = kind === "obj" ? new OBJLoader().parse(await file.text()) : (await readGltf(file)).scene;
  const parts: THREE.BufferGeometry[] = [];
  let vertices = 0;
  root.updateMatrixWorld(true);
  root.traverse((object) => {
    if (!(object instanceof THREE.Mesh)) return;
    const from = object.geometry as THREE.BufferGeometry;
    // A geometry may be used by several nodes.
    vertices += from.getAttribute("position").count;
    if (vertices > kMaxVertices) throw new Error(`${file.name} has more than ${kMaxVertices.toLocaleString("en")} vertices. Simplify it.`);
    const part = new THREE.BufferGeometry();
    part.setAttribute("position", from.getAttribute("position").clone());
    if (from.hasAttribute("uv")) part.setAttribute("uv", from.getAttribute("uv").clone());
    if (from.index) part.setIndex(from.index.clone());
    parts.push(part.applyMatrix4(placeOf(object as THREE.Mesh)));
  });
  return merged(parts, file.name, kind !== "obj");
}

// Map of the points of a mesh to the scene. One with a skin is where its first joint has it, because glTF has no other
// place for it.
function placeOf(mesh: THREE.Mesh): THREE.Matrix4 {
  if (!(mesh instanceof THREE.SkinnedMesh)) return mesh.matrixWorld;
  const { bones, boneInverses } = mesh.skeleton;
  return bones[0]!.matrixWorld.clone().multiply(boneInverses[0]!);
}

function checkSize(file: File): void {
  if (file.size > kMaxBytes)
    throw new Error(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB; at most ${kMaxBytes / 1e6} MB are allowed.`);
}

// Throws an Error whose text is for people.
export async function readGltf(file: File): Promise<GLTF> {
  checkSize(file);
  const bytes = await file.arrayBuffer();
  checkGltf(bytes, file.name, kMaxVertices);
  const draco = new DRACOLoader().setDecoderPath({ js: kDraco.js.href, wasm: kDraco.wasm.href }).setWorkerLimit(1);
  try {
    return await new GLTFLoader().setDRACOLoader(draco).parseAsync(bytes, "");
  } catch (error) {
    const why = reasonOf(error);
    if (/draco/i.test(why)) throw new Error(`${file.name} is compressed with Draco, but cannot be decoded: ${why}`);
    if (/fetch|load|buffer/i.test(why))
      throw new Error(`${file.name} needs other files. Export it as GLB, which has everything in one file. (${why})`);
    throw new Error(`${file.name} cannot be read: ${why}`);
  } finally {
    draco.dispose();
  }
}

// The worker of DRACOLoader reports errors as plain objects.
function reasonOf(error: unknown): string {
  if (error instanceof Error) return error.message;
  return typeof error === "object" && error !== null && "error" in error ? `Draco: ${String(error.error)}` : String(error);
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
