// SPDX-License-Identifier: MIT
// One cloth as a three.js mesh.

import * as THREE from "three";
import type { ClothLayout, Drawing } from "@clothstream/client";
import { type Detail, fabricMaterial } from "./fabric_material";
import { fabricOf } from "./fabrics";
import { NormalGathering } from "./normal_gathering";
import { type DrawnVertices, separateSeams } from "./seams";

// Madder, indigo, ochre, moss, plum and linen. Their brightness differs too, for colour-blind viewers.
const kColours = [0x84161f, 0x1c4f7c, 0xb87f22, 0x47693a, 0x6a3f80, 0xb5a98c];

// Expected motion of a cloth, as a fraction of its size.
const kSwing = 0.3;

// How a cloth is drawn. `number` selects the colour of dyed fabrics; `material` is a name of the server, or "".
// `gathersNormals`: the vertex shader computes the normals, and update() needs none.
export interface ClothLook {
  gathersNormals: boolean;
  number: number;
  material: string;
  detail: Detail;
}

export class ClothMesh {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshPhysicalMaterial[]>;
  private readonly positions: THREE.BufferAttribute;
  private readonly normals: THREE.BufferAttribute;
  private readonly drawn: DrawnVertices;
  private readonly gathering: NormalGathering | undefined;
  private readonly parts: number;
  private readonly woven: boolean;

  // `restPositions` and `triangles` belong to the whole scene and are copied.
  constructor(
    private readonly layout: ClothLayout,
    drawing: Drawing,
    restPositions: Float32Array,
    triangles: Uint32Array,
    private readonly look: ClothLook,
  ) {
    const corners = triangles
      .subarray(layout.firstIndex, layout.firstIndex + layout.indexCount)
      .map((index) => index - layout.firstVertex);
    this.drawn = separateSeams(layout.vertexCount, corners, drawing.uvIndices);
    if (look.gathersNormals) this.gathering = new NormalGathering(layout, corners, this.drawn);
    const rest = this.gathering?.positions ?? new Float32Array(3 * this.drawn.count);
    this.place(restPositions, rest);
    this.positions = new THREE.BufferAttribute(rest, 3).setUsage(THREE.DynamicDrawUsage);
    this.normals = new THREE.BufferAttribute(new Float32Array(rest.length), 3).setUsage(THREE.DynamicDrawUsage);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.positions);
    // Without this attribute, three.js would draw flat faces. Gathered normals leave it as it is.
    geometry.setAttribute("normal", this.normals);
    if (this.gathering) geometry.setAttribute("clothFan", this.gathering.fans);
    geometry.setIndex(new THREE.BufferAttribute(this.drawn.indices, 1));
    const uvs = this.metricCoordinates(drawing, rest);
    this.woven = uvs !== undefined;
    if (uvs) geometry.setAttribute("uv", new THREE.BufferAttribute(uvs, 2));

    const parts = drawing.submeshes.length > 0 ? drawing.submeshes : [layout];
    parts.forEach((part, index) => geometry.addGroup(part.firstIndex - layout.firstIndex, part.indexCount, index));
    this.parts = parts.length;
    this.mesh = new THREE.Mesh(geometry, []);
    this.mesh.material = this.makeMaterials();
    this.mesh.castShadow = true;
    this.mesh.receiveShadow = true;
    // Vertices move every frame. Updating the bounds would cost more than it saves in drawing and picking.
    this.mesh.frustumCulled = false;
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), Infinity);
  }

  // Shows another material of the server.
  dress(material: string): void {
    if (material === this.look.material) return;
    this.look.material = material;
    this.replaceMaterials(this.makeMaterials());
  }

  // Shows another detail as soon as its materials are compiled.
  async refine(detail: Detail, compile: (object: THREE.Object3D) => Promise<unknown>): Promise<void> {
    if (detail === this.look.detail) return;
    this.look.detail = detail;
    const before = this.mesh.material;
    const drawn = new THREE.Mesh(this.mesh.geometry, this.makeMaterials());
    drawn.receiveShadow = true;
    await compile(drawn);
    // Meanwhile the cloth may have got another material, or have gone.
    if (this.mesh.material === before) this.replaceMaterials(drawn.material);
    else for (const material of drawn.material) material.dispose();
  }

  // The arrays belong to the whole scene, and are copied. `normals` are those of the positions, or undefined if the look
  // gathers them.
  update(positions: Float32Array, normals: Float32Array | undefined): void {
    this.replace(this.positions, positions);
    this.gathering?.changed();
    if (normals) this.replace(this.normals, normals);
  }

  // Box in which the cloth will mostly stay: its start, extended downwards, and to both sides if it hangs.
  reach(): THREE.Box3 {
    const box = new THREE.Box3().setFromBufferAttribute(this.positions);
    const size = box.getSize(new THREE.Vector3());
    const swing = kSwing * Math.max(size.x, size.y, size.z);
    box.min.y -= swing;
    return box.expandByVector(new THREE.Vector3(0, 0, size.y > swing ? swing / 2 : 0));
  }

  dispose(): void {
    this.gathering?.dispose();
    this.mesh.geometry.dispose();
    this.replaceMaterials([]);
  }

  private replaceMaterials(materials: THREE.MeshPhysicalMaterial[]): void {
    for (const old of this.mesh.material) old.dispose();
    this.mesh.material = materials;
  }

  private makeMaterials(): THREE.MeshPhysicalMaterial[] {
    const { number, material, detail } = this.look;
    const fabric = fabricOf(material);
    const dye = (part: number) => kColours[(number + 2 * part) % kColours.length]!;
    return Array.from({ length: this.parts }, (_, part) => fabricMaterial(fabric, dye(part), this.woven, detail, this.gathering));
  }

  // Texture coordinates in metres, so that all cloths have threads of equal size. Undefined for a mesh without
  // coordinates.
  private metricCoordinates(drawing: Drawing, rest: Float32Array): Float32Array | undefined {
    if (this.layout.rows > 1 && this.layout.columns > 1) return gridCoordinates(this.layout, rest);
    if (drawing.uvs.length === 0) return undefined;
    const uvs = new Float32Array(2 * this.drawn.count);
    this.drawn.uvs.forEach((uv, vertex) => uvs.set(drawing.uvs.subarray(2 * uv, 2 * uv + 2), 2 * vertex));
    const scale = metresPerUv(this.drawn.indices, rest, uvs);
    return uvs.map((coordinate) => coordinate * scale);
  }

  private replace(attribute: THREE.BufferAttribute, values: Float32Array): void {
    this.place(values, attribute.array as Float32Array);
    attribute.needsUpdate = true;
  }

  // Copies the cloth's vertices to `out`, followed by the duplicates at seams.
  private place(values: Float32Array, out: Float32Array): void {
    const { firstVertex, vertexCount } = this.layout;
    const isAll = values.length === 3 * vertexCount;
    out.set(isAll ? values : values.subarray(3 * firstVertex, 3 * (firstVertex + vertexCount)));
    const { copies } = this.drawn;
    for (let copy = 0; copy < copies.length; ++copy) {
      const from = 3 * copies[copy]!;
      out.copyWithin(3 * (vertexCount + copy), from, from + 3);
    }
  }
}

// Metres of cloth per unit of texture coordinates, from the areas of all triangles.
function metresPerUv(indices: Uint32Array, rest: Float32Array, uvs: Float32Array): number {
  const corner = (k: number) => new THREE.Vector3().fromArray(rest, 3 * indices[k]!);
  const uv = (k: number) => new THREE.Vector2().fromArray(uvs, 2 * indices[k]!);
  let cloth = 0;
  let texture = 0;
  for (let t = 0; t < indices.length; t += 3) {
    const origin = corner(t);
    cloth += corner(t + 1).sub(origin).cross(corner(t + 2).sub(origin)).length();
    texture += Math.abs(uv(t + 1).sub(uv(t)).cross(uv(t + 2).sub(uv(t))));
  }
  return texture > 0 ? Math.sqrt(cloth / texture) : 0;
}

function gridCoordinates(layout: ClothLayout, rest: Float32Array): Float32Array {
  const vertex = (row: number, column: number) =>
    new THREE.Vector3().fromArray(rest, 3 * (row * layout.columns + column));
  const width = vertex(0, 0).distanceTo(vertex(0, layout.columns - 1));
  const height = vertex(0, 0).distanceTo(vertex(layout.rows - 1, 0));
  const coordinates = new Float32Array(2 * layout.vertexCount);
  for (let i = 0; i < layout.vertexCount; ++i) {
    coordinates[2 * i] = ((i % layout.columns) / (layout.columns - 1)) * width;
    coordinates[2 * i + 1] = -(Math.floor(i / layout.columns) / (layout.rows - 1)) * height;
  }
  return coordinates;
}
