// SPDX-License-Identifier: MIT
// `window.clothstream`: read-only view of the page's state, for tests and debugging.

import type { BodyPart, BodyPose, Client, ClothLayout, ClothReport, Collider, Link, Participant, Playback, Session, SessionState, SkinLimitLists, Stages, Statistics, Vec3 } from "@clothstream/client";
import * as THREE from "three";
import type { CanvasPanel, Doing, Headset } from "@clothstream/three";
import type { FrameWork } from "./frame_work";
import type { Create } from "./panel/create";
import type { HudHistory } from "./panel/hud_history";
import type { View } from "./view";

export interface Probe {
  readonly state: SessionState["kind"];
  // Arrays are copies with 3 floats per vertex.
  readonly statistics: Statistics;
  // How frames travel.
  readonly link: Link;
  // Stages of the newest frame and state of play-out. Undefined before the first frame.
  readonly stages: Stages | undefined;
  readonly positions: Float32Array;
  readonly restPositions: Float32Array | undefined;
  readonly normals: Float32Array;
  // Drawn positions of each cloth. Vertices at seams appear several times.
  readonly drawn: Float32Array[];
  // Whether the picture has all its detail (view.ts).
  readonly isComplete: boolean;
  readonly cloths: ClothLayout[];
  // Newest report of each cloth, undefined before the first.
  readonly reports: (ClothReport | undefined)[];
  readonly colliders: Collider[];
  // Names of other participants that are drawn, and the places of their labels.
  readonly people: View["shownPeople"];
  // Surfaces of the real rooms of others that are drawn.
  readonly roomSurfaces: number;
  // Drawn positions of the scene's colliders.
  readonly drawnColliders: Vec3[];
  // Drawn vertices of the scene's colliders, in their frames.
  readonly drawnColliderVertices: Float32Array[];
  // Drawn ends of active constraints, 3 floats each.
  readonly constraintEnds: Float32Array;
  readonly participants: Participant[];
  // Defined if the scene is a recording.
  readonly playback: Playback | undefined;
  // Longest pause between frames in the last minute, ms.
  readonly longestPause: number;
  // Length of the largest correction by local contact, m.
  readonly localCorrection: number;
  readonly drawnFrames: number;
  // Times of this thread for the newest frames, ms, in ascending order (frame_work.ts).
  readonly work: { input: number[]; show: number[]; render: number[]; take: number[] };
  readonly headset: HeadsetProbe;
  readonly canvas: HTMLCanvasElement;
  // Vertices that the form for a new scene pins.
  readonly limits: SkinLimitLists;
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
  readonly shadowReach: number; // half the width of the shadow map in the room, m
  // Surfaces of the real room: those that are drawn, and those that the server has.
  readonly room: { detects: boolean; shares: boolean; detected: number; sent: number };
  // Chooses what the next presses do, like the panel in space. The functions choose and press are those of the probe that change something.
  choose(doing: Doing): void;
  // Presses a button of the panel in space by its text.
  press(text: string): void;
  // The panel in space: its middle in the room, its picture, lines of text, and buttons with the places of their middles.
  readonly panel: {
    readonly place: Vec3;
    readonly canvas: HTMLCanvasElement;
    readonly texts: string[];
    readonly buttons: { text: string; isChosen: boolean; isEnabled: boolean; place: Vec3 }[];
  };
  // The own body: name ("" for none), and where its parts are in the scene. `mirror`: whether a mirror stands there.
  readonly worn: { name: string; mirror: boolean; part(part: BodyPart): BodyPose | undefined };
  // Hands, controllers and rays that are there. Joints: x, y, z, radius of each, in the scene.
  readonly limbs: { side: string; isHand: boolean; holds: boolean; joints: number[]; point: Vec3 }[];
}

declare global {
  interface Window {
    clothstream?: Probe;
  }
}

// Parts of a page that tests read. The self-test has neither a form for scenes nor a history.
export interface Exposed {
  headset: Headset;
  panel: CanvasPanel; // in space
  work: FrameWork;
  history?: HudHistory;
  create?: Create;
}

// Call described() of the result for each description, before its first frame.
export function expose(session: Session, view: View, { headset, panel, work, history, create }: Exposed): { described(client: Client): void } {
  let restPositions: Float32Array | undefined;
  window.clothstream = {
    get state() {
      return session.state.kind;
    },
    get statistics() {
      return session.client.frames.statistics();
    },
    get link() {
      return session.link;
    },
    get stages() {
      return session.client.frames.stages();
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
    get isComplete() {
      return view.isComplete;
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
    get roomSurfaces() {
      return view.roomSurfaces;
    },
    get drawnColliders() {
      return view.colliders.map(({ position }) => position.toArray());
    },
    get drawnColliderVertices() {
      return view.colliders.map(({ geometry }) => new Float32Array(geometry.getAttribute("position").array));
    },
    get constraintEnds() {
      return view.constraintEnds;
    },
    get participants() {
      return session.client.people.participants();
    },
    get playback() {
      return session.client.playback.state();
    },
    get longestPause() {
      return history?.largest("pause") ?? 0;
    },
    get localCorrection() {
      return session.client.frames.localCorrection;
    },
    get drawnFrames() {
      return work.drawn;
    },
    get work() {
      const { input, show, render, take } = work;
      return { input: [...input.sorted()], show: [...show.sorted()], render: [...render.sorted()], take: [...take.sorted()] };
    },
    get headset() {
      return {
        mode: headset.mode,
        doing: headset.doing,
        frames: headset.frameCount,
        isAnchored: headset.isAnchored,
        placement: headset.placement.matrix.toArray(),
        shadowReach: view.shadowReach,
        room: { detects: headset.realRoom.detects, shares: headset.realRoom.shares, ...headset.realRoom.counts },
        choose: (doing: Doing) => headset.do(doing),
        worn: {
          name: session.client.wearing.own,
          mirror: view.hasMirror,
          part: (part: BodyPart) => session.client.wearing.part(part),
        },
        press: (text: string) => panel.pressText(text),
        panel: {
          place: panel.mesh.getWorldPosition(new THREE.Vector3()).toArray(),
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
    get limits() {
      return create?.limits ?? {};
    },
    get pinned() {
      return create?.pinned ?? new Uint32Array();
    },
    project: (point) => view.project(point),
    shadowOf: (point) => view.shadowOf(point),
  };
  return { described: (client) => void (restPositions = client.frames.positions().slice()) };
}
