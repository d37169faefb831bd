// SPDX-License-Identifier: MIT
// Normals that the vertex shader computes from the positions, for streams without normals. The positions are a texture,
// and each vertex has a list of the faces around it: its fan.
//
// The normal is that of proto/codec/vertex_normals.h: the normalised sum of (c - p) x (b - a) over the faces around the
// vertex p. In a quad of a grid, a and b are the neighbours of p, and c is opposite; in a triangle (p, c, b), a is p.

import * as THREE from "three";
import type { ClothLayout } from "@clothstream/client";
import type { DrawnVertices } from "./seams";

const kFanWidth = 1024; // texels
const kPositionWidth = 256;

export class NormalGathering {
  readonly uniforms: Record<"clothPositions" | "clothFans", { value: THREE.DataTexture }>;
  // 3 floats for each drawn vertex. Call changed() after writing.
  readonly positions: Float32Array;
  // First face and number of faces of each drawn vertex.
  readonly fans: THREE.BufferAttribute;

  // `corners` has three vertices per triangle of the cloth.
  constructor(layout: ClothLayout, corners: Uint32Array, drawn: DrawnVertices) {
    const faces = layout.rows > 1 && layout.columns > 1 ? facesOfGrid(layout.rows, layout.columns) : facesOfMesh(corners);
    const ranges = new Uint32Array(layout.vertexCount + 1);
    for (let face = 0; face < faces.length; face += 4) ++ranges[faces[face]! + 1]!;
    for (let vertex = 0; vertex < layout.vertexCount; ++vertex) ranges[vertex + 1]! += ranges[vertex]!;
    const texels = new Uint32Array(4 * kFanWidth * rowsOf(faces.length / 4, kFanWidth));
    const next = ranges.slice();
    for (let face = 0; face < faces.length; face += 4) texels.set(faces.subarray(face + 1, face + 4), 4 * next[faces[face]!]++);
    const fans = new Float32Array(2 * drawn.count);
    for (let i = 0; i < drawn.count; ++i) {
      const vertex = i < layout.vertexCount ? i : drawn.copies[i - layout.vertexCount]!;
      fans[2 * i] = ranges[vertex]!;
      fans[2 * i + 1] = ranges[vertex + 1]! - ranges[vertex]!;
    }
    this.fans = new THREE.BufferAttribute(fans, 2);
    const rows = rowsOf(drawn.count, kPositionWidth);
    const padded = new Float32Array(3 * kPositionWidth * rows);
    this.positions = padded.subarray(0, 3 * drawn.count);
    const clothPositions = new THREE.DataTexture(padded, kPositionWidth, rows, THREE.RGBFormat, THREE.FloatType);
    clothPositions.internalFormat = "RGB32F";
    const clothFans = new THREE.DataTexture(texels, kFanWidth, texels.length / (4 * kFanWidth), THREE.RGBAIntegerFormat, THREE.UnsignedIntType);
    clothFans.internalFormat = "RGBA32UI";
    clothFans.needsUpdate = clothPositions.needsUpdate = true;
    this.uniforms = { clothPositions: { value: clothPositions }, clothFans: { value: clothFans } };
  }

  changed(): void {
    this.uniforms.clothPositions.value.needsUpdate = true;
  }

  dispose(): void {
    for (const { value } of Object.values(this.uniforms)) value.dispose();
  }
}

// Replaces the normal of the geometry in a vertex shader of three.js.
export function gatherNormals(vertexShader: string): string {
  return vertexShader
    .replace("#include <common>", `#include <common>\n${kGather}`)
    .replace("#include <beginnormal_vertex>", "vec3 objectNormal = clothNormal( position );");
}

const kGather = /* glsl */ `
uniform highp sampler2D clothPositions;
uniform highp usampler2D clothFans;
attribute vec2 clothFan;
vec3 clothPosition(uint vertex) {
  return texelFetch(clothPositions, ivec2(vertex % ${kPositionWidth}u, vertex / ${kPositionWidth}u), 0).xyz;
}
vec3 clothNormal(vec3 p) {
  vec3 sum = vec3(0.0);
  int first = int(clothFan.x);
  int last = first + int(clothFan.y);
  for (int face = first; face < last; ++face) {
    uvec3 corners = texelFetch(clothFans, ivec2(face % ${kFanWidth}, face / ${kFanWidth}), 0).xyz;
    sum += cross(clothPosition(corners.y) - p, clothPosition(corners.z) - clothPosition(corners.x));
  }
  float squared = dot(sum, sum);
  return squared >= 1e-30 ? sum * inversesqrt(squared) : vec3(0.0, 0.0, 1.0);
}
`;

// Four numbers per face and vertex of it: the vertex, then a, c and b.
function facesOfGrid(rows: number, columns: number): Uint32Array {
  const faces = new Uint32Array(16 * (rows - 1) * (columns - 1));
  let at = 0;
  for (let row = 0; row + 1 < rows; ++row) {
    for (let column = 0; column + 1 < columns; ++column) {
      const p = row * columns + column;
      // Counter-clockwise, as seen from the front.
      const ring = [p, p + columns, p + columns + 1, p + 1];
      for (let k = 0; k < 4; ++k) {
        faces.set([ring[k]!, ring[(k + 1) % 4]!, ring[(k + 2) % 4]!, ring[(k + 3) % 4]!], at);
        at += 4;
      }
    }
  }
  return faces;
}

function facesOfMesh(corners: Uint32Array): Uint32Array {
  const faces = new Uint32Array(4 * corners.length);
  for (let corner = 0; corner < corners.length; ++corner) {
    const first = corner - (corner % 3);
    const p = corners[corner]!;
    faces.set([p, p, corners[first + ((corner + 1) % 3)]!, corners[first + ((corner + 2) % 3)]!], 4 * corner);
  }
  return faces;
}

function rowsOf(count: number, width: number): number {
  return Math.max(1, Math.ceil(count / width));
}
