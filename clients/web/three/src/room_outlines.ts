// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of others: thin outlines that hide cloth behind them and take its shadow.

import * as THREE from "three";
import type { Client } from "@clothstream/client";

// Angle between two triangles from which their edge is drawn, degrees.
const kSharpEdge = 40;

interface Outlined {
  group: THREE.Group;
  revision: bigint;
}

export class RoomOutlines {
  readonly group = new THREE.Group();
  private readonly shown = new Map<string, Outlined>(); // by participant and id
  private readonly lines = new THREE.LineBasicMaterial({ color: 0x8aa0b8, transparent: true, opacity: 0.55 });
  // A room is open towards who looks into it from outside, so only fronts hide cloth.
  private readonly cover = new THREE.MeshBasicMaterial({ colorWrite: false, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 });
  private readonly shade = new THREE.ShadowMaterial({ opacity: 0.3, depthWrite: false });

  get count(): number {
    return this.shown.size;
  }

  // Shows the surfaces that the client has now. Call when they change, and for a new client.
  show(client: Client): void {
    const { surfaces } = client.input;
    const gone = new Set(this.shown.keys());
    for (const { participantId, id, revision, position, orientation } of surfaces.others()) {
      const key = `${participantId} ${id}`;
      gone.delete(key);
      if (this.shown.get(key)?.revision !== revision) {
        this.remove(key);
        const mesh = surfaces.mesh(revision);
        if (!mesh) continue;
        this.shown.set(key, { group: this.outline(mesh.positions, mesh.triangles), revision });
      }
      const { group } = this.shown.get(key)!;
      group.position.fromArray(position);
      group.quaternion.fromArray(orientation);
    }
    for (const key of gone) this.remove(key);
  }

  private outline(positions: Float32Array, triangles: Uint32Array): THREE.Group {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
    const cover = new THREE.Mesh(geometry, this.cover);
    cover.renderOrder = -1;
    const shade = new THREE.Mesh(geometry, this.shade);
    shade.receiveShadow = true;
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(geometry, kSharpEdge), this.lines);
    const group = new THREE.Group().add(cover, shade, edges);
    this.group.add(group);
    return group;
  }

  private remove(key: string): void {
    const outlined = this.shown.get(key);
    if (!outlined) return;
    this.group.remove(outlined.group);
    for (const child of outlined.group.children as (THREE.Mesh | THREE.LineSegments)[]) child.geometry.dispose();
    this.shown.delete(key);
  }
}
