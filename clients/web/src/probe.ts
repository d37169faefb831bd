// SPDX-License-Identifier: MIT
// `window.clothstream`: lets tests and the curious look inside; it changes nothing.

import type { Client, ClothLayout, ClothReport, Collider, Participant, Playback, Statistics, Vec3 } from "./client";
import type { Session, SessionState } from "./session";
import type { View } from "./view";

export interface Probe {
  readonly state: SessionState["kind"];
  // Arrays are copies, 3 floats a vertex.
  readonly statistics: Statistics;
  readonly positions: Float32Array;
  readonly restPositions: Float32Array | undefined;
  readonly normals: Float32Array;
  // Positions as they are drawn, of each cloth; beside seams more often than once.
  readonly drawn: Float32Array[];
  readonly cloths: ClothLayout[];
  // Of each cloth, once there is one.
  readonly reports: (ClothReport | undefined)[];
  readonly colliders: Collider[];
  // Where these are drawn.
  readonly drawnColliders: Vec3[];
  readonly participants: Participant[];
  // Of a scene that is a recording.
  readonly playback: Playback | undefined;
  readonly canvas: HTMLCanvasElement;
  // A point of the scene, in CSS pixels of the page.
  project(point: Vec3): [number, number];
  // Where the key light casts the point's shadow on the floor.
  shadowOf(point: Vec3): Vec3;
}

declare global {
  interface Window {
    clothstream?: Probe;
  }
}

// The result is to be told each description, before any frame.
export function expose(session: Session, view: View): { described(client: Client): void } {
  let restPositions: Float32Array | undefined;
  window.clothstream = {
    get state() {
      return session.state.kind;
    },
    get statistics() {
      return session.client.statistics();
    },
    get positions() {
      return session.client.positions().slice();
    },
    get restPositions() {
      return restPositions?.slice();
    },
    get normals() {
      return session.client.normals().slice();
    },
    get drawn() {
      return view.clothMeshes.map((mesh) => new Float32Array(mesh.geometry.getAttribute("position").array));
    },
    get cloths() {
      return session.client.cloths();
    },
    get reports() {
      const { client } = session;
      return client.cloths().map((_, index) => client.report(index));
    },
    get colliders() {
      return session.client.colliders();
    },
    get drawnColliders() {
      return view.colliders.map(({ position }) => position.toArray());
    },
    get participants() {
      return session.client.participants();
    },
    get playback() {
      return session.client?.playback();
    },
    canvas: view.canvas,
    project: (point) => view.project(point),
    shadowOf: (point) => view.shadowOf(point),
  };
  return { described: (client) => void (restPositions = client.positions().slice()) };
}
