// SPDX-License-Identifier: MIT
// One cloth as a three.js mesh, whose vertices are drawn straight from the core's memory.

import * as THREE from "three";
import type { ClothLayout } from "./client";

// Madder, indigo, ochre, moss, plum, linen: told apart also where colours are not.
const kColours = [0x8a3433, 0x2a567a, 0xb5843c, 0x55714a, 0x745684, 0xb5a98f];

// Metres that one tile of the weave covers, which is two threads.
const kWeaveTile = 0.012;
// How far a cloth moves away from where it starts, in parts of its size.
const kSwing = 0.3;
const kWeaveTexels = 32;

export class ClothMesh {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshPhysicalMaterial>;
  private readonly positions: THREE.BufferAttribute;
  private readonly normals: THREE.BufferAttribute;

  // `restPositions` and `triangles` are those of the whole scene; they are copied.
  constructor(
    private readonly layout: ClothLayout,
    restPositions: Float32Array,
    triangles: Uint32Array,
    number: number,
  ) {
    const rest = this.part(restPositions).slice();
    this.positions = new THREE.BufferAttribute(rest, 3).setUsage(THREE.DynamicDrawUsage);
    this.normals = new THREE.BufferAttribute(new Float32Array(rest.length), 3).setUsage(THREE.DynamicDrawUsage);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.positions);
    geometry.setAttribute("normal", this.normals);
    const indices = triangles.subarray(layout.firstIndex, layout.firstIndex + layout.indexCount);
    geometry.setIndex(new THREE.BufferAttribute(indices.map((index) => index - layout.firstVertex), 1));

    const colour = new THREE.Color(kColours[number % kColours.length]);
    const material = new THREE.MeshPhysicalMaterial({
      color: colour,
      roughness: 0.82,
      sheen: 0.35,
      sheenRoughness: 0.45,
      sheenColor: colour.clone().lerp(new THREE.Color(0xffffff), 0.35),
      side: THREE.DoubleSide,
    });
    if (layout.rows > 1 && layout.columns > 1) {
      geometry.setAttribute("uv", threadCoordinates(layout, rest));
      material.normalMap = weaveNormals();
      material.normalScale.setScalar(0.22);
    }
    this.mesh = new THREE.Mesh(geometry, material);
    this.mesh.castShadow = true;
    this.mesh.receiveShadow = true;
    // The vertices move every frame: bounds kept up to date would cost more than drawing.
    this.mesh.frustumCulled = false;
  }

  // The arrays are the whole scene's, in the core's memory: they are read when the frame is drawn, not kept.
  update(positions: Float32Array, normals: Float32Array): void {
    this.positions.array = this.part(positions);
    this.positions.needsUpdate = true;
    this.normals.array = this.part(normals);
    this.normals.needsUpdate = true;
  }

  // Where the cloth will mostly be: as it starts, and from there down and to both sides, where it falls and flies.
  reach(): THREE.Box3 {
    const box = new THREE.Box3().setFromBufferAttribute(this.positions);
    const size = box.getSize(new THREE.Vector3());
    const swing = kSwing * Math.max(size.x, size.y, size.z);
    box.min.y -= swing;
    return box.expandByVector(new THREE.Vector3(0, 0, swing / 2));
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private part(values: Float32Array): Float32Array {
    return values.subarray(3 * this.layout.firstVertex, 3 * (this.layout.firstVertex + this.layout.vertexCount));
  }
}

// Texture coordinates that count threads, so that every cloth has threads of the same size.
function threadCoordinates(layout: ClothLayout, rest: Float32Array): THREE.BufferAttribute {
  const vertex = (row: number, column: number) =>
    new THREE.Vector3().fromArray(rest, 3 * (row * layout.columns + column));
  const width = vertex(0, 0).distanceTo(vertex(0, layout.columns - 1)) / kWeaveTile;
  const height = vertex(0, 0).distanceTo(vertex(layout.rows - 1, 0)) / kWeaveTile;
  const coordinates = new Float32Array(2 * layout.vertexCount);
  for (let i = 0; i < layout.vertexCount; ++i) {
    coordinates[2 * i] = ((i % layout.columns) / (layout.columns - 1)) * width;
    coordinates[2 * i + 1] = -(Math.floor(i / layout.columns) / (layout.rows - 1)) * height;
  }
  return new THREE.BufferAttribute(coordinates, 2);
}

let weave: THREE.DataTexture | undefined;

// Normal map of a plain weave: round threads that pass over and under each other.
function weaveNormals(): THREE.DataTexture {
  if (weave) return weave;
  const height = (x: number, y: number) => {
    const warp = Math.abs(Math.sin(Math.PI * x)) + 0.5 * Math.cos(Math.PI * y) * (Math.floor(x) % 2 ? 1 : -1);
    const weft = Math.abs(Math.sin(Math.PI * y)) + 0.5 * Math.cos(Math.PI * x) * (Math.floor(y) % 2 ? -1 : 1);
    return 0.3 * Math.max(warp, weft);
  };
  const texels = new Uint8Array(4 * kWeaveTexels * kWeaveTexels);
  const normal = new THREE.Vector3();
  const step = 2 / kWeaveTexels;
  for (let row = 0; row < kWeaveTexels; ++row) {
    for (let column = 0; column < kWeaveTexels; ++column) {
      const x = (column + 0.5) * step;
      const y = (row + 0.5) * step;
      normal.set((height(x - step, y) - height(x + step, y)) / (2 * step), (height(x, y - step) - height(x, y + step)) / (2 * step), 1);
      normal.normalize().addScalar(1).multiplyScalar(127.5);
      texels.set([normal.x, normal.y, normal.z, 255], 4 * (row * kWeaveTexels + column));
    }
  }
  weave = new THREE.DataTexture(texels, kWeaveTexels, kWeaveTexels);
  weave.wrapS = weave.wrapT = THREE.RepeatWrapping;
  weave.magFilter = THREE.LinearFilter;
  weave.minFilter = THREE.LinearMipmapLinearFilter;
  weave.generateMipmaps = true;
  weave.anisotropy = 8;
  weave.needsUpdate = true;
  return weave;
}
