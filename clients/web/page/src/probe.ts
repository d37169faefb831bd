// SPDX-License-Identifier: MIT
// `window.clothstream`: read-only view of the page's state, for tests and debugging.

import type { Client, ClothLayout, ClothReport, Collider, Participant, Playback, Session, SessionState, Statistics, Vec3 } from "@clothstream/client";
import type { Doing } from "@clothstream/three";
import type { HeadsetPage } from "./headset_page";
import type { Create } from "./panel/create";
import type { View } from "./view";

export interface Probe {
  readonly state: SessionState["kind"];
  // Arrays are copies with 3 floats per vertex.
  readonly statistics: Statistics;
  readonly positions: Float32Array;
  readonly restPositions: Float32Array | undefined;
  readonly normals: Float32Array;
  // Drawn positions of each cloth. Vertices at seams appear several times.
  readonly drawn: Float32Array[];
  readonly cloths: ClothLayout[];
  // Newest report of each cloth, undefined before the first.
  readonly reports: (ClothReport | undefined)[];
  readonly colliders: Collider[];
  // Names of other participants that are drawn, and the places of their labels.
  readonly people: View["shownPeople"];
  // Drawn positions of the scene's colliders.
  readonly drawnColliders: Vec3[];
  readonly participants: Participant[];
  // Defined if the scene is a recording.
  readonly playback: Playback | undefined;
  // Length of the largest correction by local contact, m.
  readonly localCorrection: number;
  readonly headset: HeadsetProbe;
  readonly canvas: HTMLCanvasElement;
  // Vertices that the form for a new scene pins.
  readonly pinned: Uint32Array;
  // Projects a point of the scene to CSS pixels of the page.
  project(point: Vec3): [number, number];
  // Position of the point's shadow on the floor, cast by the key light.
  shadowOf(point: Vec3): Vec3;
}

// The headset of this page.
export interface HeadsetProbe {
  readonly mode: string | undefined; // of the session
  readonly doing: Doing;
  readonly frames: number; // drawn in sessions
  readonly isAnchored: boolean;
  readonly placement: number[]; // matrix from scene to room, column by column
  // Chooses what the next presses do, like the panel in space. The one function of the probe that changes something.
  choose(doing: Doing): void;
  // The panel in space: its picture, lines of text, and buttons with the places of their middles in the room.
  readonly panel: {
    readonly canvas: HTMLCanvasElement;
    readonly texts: string[];
    readonly buttons: { text: string; isChosen: boolean; isEnabled: boolean; place: Vec3 }[];
  };
  // Hands, controllers and rays that are there. Joints: x, y, z, radius of each, in the scene.
  readonly limbs: { side: string; isHand: boolean; holds: boolean; joints: number[]; point: Vec3 }[];
}

declare global {
  interface Window {
    clothstream?: Probe;
  }
}

// Call described() of the result for each description, before its first frame.
export function expose(session: Session, view: View, { headset, panel }: HeadsetPage, create: Create): { described(client: Client): void } {
  let restPositions: Float32Array | undefined;
  window.clothstream = {
    get state() {
      return session.state.kind;
    },
    get statistics() {
      return session.client.frames.statistics();
    },
    get positions() {
      return session.client.frames.positions().slice();
    },
    get restPositions() {
      return restPositions?.slice();
    },
    get normals() {
      return session.client.frames.normals().slice();
    },
    get drawn() {
      return view.clothMeshes.map((mesh) => new Float32Array(mesh.geometry.getAttribute("position").array));
    },
    get cloths() {
      return session.client.frames.cloths();
    },
    get reports() {
      const { client } = session;
      return client.frames.cloths().map((_, index) => client.parameters.report(index));
    },
    get colliders() {
      return session.client.frames.colliders();
    },
    get people() {
      return view.shownPeople;
    },
    get drawnColliders() {
      return view.colliders.map(({ position }) => position.toArray());
    },
    get participants() {
      return session.client.people.participants();
    },
    get playback() {
      return session.client.playback.state();
    },
    get localCorrection() {
      return session.client.frames.localCorrection;
    },
    get headset() {
      return {
        mode: headset.mode,
        doing: headset.doing,
        frames: headset.frameCount,
        isAnchored: headset.isAnchored,
        placement: headset.placement.matrix.toArray(),
        choose: (doing: Doing) => headset.do(doing),
        panel: {
          canvas: panel.canvas,
          texts: panel.texts,
          buttons: panel.buttons.map((button) => ({ ...button, place: button.place.toArray() })),
        },
        limbs: Array.from(headset.body.present(), ({ side, isHand, grabber, hand, pose }) => ({
          side,
          isHand,
          holds: grabber.holds,
          joints: isHand ? [...hand.joints] : [],
          point: pose.point.toArray(),
        })),
      };
    },
    canvas: view.canvas,
    get pinned() {
      return create.pinned;
    },
    project: (point) => view.project(point),
    shadowOf: (point) => view.shadowOf(point),
  };
  return { described: (client) => void (restPositions = client.frames.positions().slice()) };
}
