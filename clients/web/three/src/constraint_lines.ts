// SPDX-License-Identifier: MIT
// The active constraints of cloths with ACAD as lines over the cloths, in a colour that no fabric has.

import * as THREE from "three";
import type { Client } from "@clothstream/client";

// Constraints that lines have room for at first.
const kRoom = 1024;

export class ConstraintLines {
  readonly lines = new THREE.LineSegments(
    new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ color: 0x00d5ff, toneMapped: false, depthTest: false, transparent: true, opacity: 0.85 }),
  );
  private firstVertices: number[] = [];
  private places = new Float32Array(0);

  constructor() {
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1;
    this.makeRoom(kRoom);
    this.clear();
  }

  describe(client: Client): void {
    this.firstVertices = client.frames.cloths().map(({ firstVertex }) => firstVertex);
    this.clear();
  }

  clear(): void {
    this.lines.geometry.setDrawRange(0, 0);
    this.lines.visible = false;
  }

  // Draws the constraints of the newest report between the vertices that are shown.
  show(client: Client): void {
    let count = 0;
    for (let cloth = 0; cloth < this.firstVertices.length; ++cloth) {
      const ends = client.parameters.constraintEnds(cloth);
      if (ends.length === 0) continue;
      this.makeRoom((count + ends.length) / 2);
      const positions = client.frames.shownPositions();
      const first = this.firstVertices[cloth]!;
      for (let i = 0; i < ends.length; ++i) {
        const from = 3 * (first + ends[i]!), to = 3 * (count + i);
        for (let axis = 0; axis < 3; ++axis) this.places[to + axis] = positions[from + axis]!;
      }
      count += ends.length;
    }
    this.lines.geometry.setDrawRange(0, count);
    this.lines.geometry.getAttribute("position").needsUpdate = true;
    this.lines.visible = count > 0;
  }

  // Drawn ends, three numbers each.
  get ends(): Float32Array {
    return this.places.slice(0, 3 * this.lines.geometry.drawRange.count);
  }

  private makeRoom(constraints: number): void {
    if (6 * constraints <= this.places.length) return;
    const places = new Float32Array(6 * Math.max(constraints, this.places.length / 3));
    places.set(this.places);
    this.places = places;
    this.lines.geometry.dispose();
    this.lines.geometry.setAttribute("position", new THREE.BufferAttribute(places, 3).setUsage(THREE.DynamicDrawUsage));
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}
