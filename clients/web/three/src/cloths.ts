// SPDX-License-Identifier: MIT
// All cloths of a client, as one three.js object.

import * as THREE from "three";
import type { Client } from "@clothstream/client";
import { ClothMesh } from "./cloth_mesh";
import type { Detail } from "./fabric_material";

export class Cloths {
  readonly group = new THREE.Group();
  private list: ClothMesh[] = [];
  private vertexCount = 0;

  // `gathersNormals`: the vertex shader computes normals that the stream does not have.
  constructor(
    private detail: Detail = "full",
    private readonly gathersNormals = true,
  ) {}

  get meshes(): THREE.Mesh[] {
    return this.list.map((cloth) => cloth.mesh);
  }

  // Box in which the cloths will mostly stay.
  reach(): THREE.Box3 {
    return this.list.reduce((box, cloth) => box.union(cloth.reach()), new THREE.Box3());
  }

  // Replaces the cloths by those of a new description.
  describe(client: Client): void {
    this.dispose();
    const { frames, parameters } = client;
    this.vertexCount = frames.vertexCount;
    const layouts = frames.cloths();
    const drawings = layouts.map((_, number) => frames.drawing(number));
    const materials = layouts.map((_, number) => parameters.material(number));
    const rest = frames.positions();
    const triangles = frames.triangles();
    this.list = layouts.map((layout, number) => {
      const look = { number, material: materials[number]!, detail: this.detail, gathersNormals: this.gathers(client) };
      return new ClothMesh(layout, drawings[number]!, rest, triangles, look);
    });
    for (const cloth of this.list) this.group.add(cloth.mesh);
  }

  // Shows the current materials. Call when parameters change.
  dress(client: Client): void {
    this.list.forEach((cloth, number) => cloth.dress(client.parameters.material(number)));
  }

  // Changes the detail, without a pause in the drawing: `compile` makes an object ready to be drawn.
  async refine(detail: Detail, compile: (object: THREE.Object3D) => Promise<unknown>): Promise<void> {
    this.detail = detail;
    await Promise.all(this.list.map((cloth) => cloth.refine(detail, compile)));
  }

  // Shows the cloths as they are at a time of performance.now(). Returns false, and changes nothing, if the client is
  // joining and has no cloths yet.
  show(client: Client, now: number): boolean {
    const { frames } = client;
    if (frames.vertexCount !== this.vertexCount) return false;
    frames.showAt(now);
    const normals = this.gathers(client) ? undefined : frames.shownNormals();
    const positions = frames.shownPositions();
    for (let number = 0; number < this.list.length; ++number) this.list[number]!.update(positions, normals);
    return true;
  }

  private gathers(client: Client): boolean {
    return this.gathersNormals && !client.frames.sendsNormals;
  }

  dispose(): void {
    for (const cloth of this.list) {
      this.group.remove(cloth.mesh);
      cloth.dispose();
    }
    this.list = [];
  }
}
