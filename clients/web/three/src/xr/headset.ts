// SPDX-License-Identifier: MIT
// A user with a headset in the scene: enters and leaves, places the scene in the room, and touches the cloth.

import * as THREE from "three";
import type { Client, Input } from "@clothstream/client";
import { Body } from "./body";
import { Figures } from "./figures";
import { kReach } from "./grabber";
import { HitTest } from "./hit_test";
import { Immersion, type Mode } from "./immersion";
import type { Limb } from "./limb";
import { Placement, TwoHandMove } from "./placement";
import { Wearer } from "./wearer";
import { RealRoom } from "./real_room";

// Distance from the user to the front of the scene when it is placed, m.
const kArmLength = 0.5;
const kForward = new THREE.Vector3(0, 0, -1);

export interface HeadsetHost {
  readonly renderer: THREE.WebGLRenderer;
  // Its matrix places everything in the room.
  readonly scene: THREE.Scene;
  // Box of the cloths and colliders in the scene, whose lower face lies on the floor.
  bounds(): THREE.Box3;
  // Changes the input of the present client and sends it, also while no frames come.
  change(change: (input: Input) => void): void;
  // The real room is seen instead of the drawn one. hasFloor: its surfaces take the cloth's shadow, so that the floor of
  // the scene need not.
  passThrough(on: boolean, hasFloor: boolean): void;
}

export interface HeadsetListener {
  entered?(mode: Mode): void;
  left?(): void;
  // A press that the program uses itself, for example on a panel. Returns whether it does.
  pressed?(limb: Limb): boolean;
  // Poses are read, and presses not yet used.
  updated?(): void;
  // The next presses do something else now.
  doingChanged?(doing: Doing): void;
}

// touch: presses take hold of the cloth. place: the next press puts the scene on the surface that is looked at. points:
// the next two presses are the points that all headsets in the room touch.
export type Doing = "touch" | "place" | "points";

export class Headset {
  readonly placement = new Placement();
  readonly body = new Body();
  // Objects in room coordinates.
  readonly room = new THREE.Group();
  // Objects that stand where the user stood when the scene was placed, and look the same way.
  readonly seat = new THREE.Group();
  readonly realRoom = new RealRoom();
  doing: Doing = "touch";
  private readonly figures = new Figures();
  private readonly hitTest = new HitTest();
  private readonly wearer = new Wearer();
  private readonly immersion: Immersion;
  private placed = false;
  private sharesRoom = false; // in the session that begins
  private passesThrough = false;
  private hasFloor = false; // of the real room
  private looksForSurfaces = false; // the hit test is about to start
  private firstPoint: THREE.Vector3 | undefined;
  private move: { hands: TwoHandMove; left: Limb; right: Limb } | undefined;
  private frames = 0;

  constructor(
    private readonly host: HeadsetHost,
    private readonly listener: HeadsetListener = {},
  ) {
    this.immersion = new Immersion(host.renderer, {
      entered: (mode, session) => this.entered(mode, session),
      left: () => this.left(),
      // Without frames, hands would stay in the scene and hold the cloth.
      visibilityChanged: (visible) => {
        if (!visible) this.host.change((input) => this.body.leave(input));
      },
    });
    this.room.matrixAutoUpdate = false;
    this.room.add(this.hitTest.reticle, this.seat, this.realRoom.group);
    host.scene.add(this.room, this.figures.group);
    this.room.visible = this.figures.group.visible = false;
  }

  get mode(): Mode | undefined {
    return this.immersion.mode;
  }
  get session(): XRSession | undefined {
    return this.immersion.session;
  }
  // Whether an anchor of the device keeps the scene in its place.
  get isAnchored(): boolean {
    return this.hitTest.isAnchored;
  }
  // Frames of headsets that update() has seen.
  get frameCount(): number {
    return this.frames;
  }

  // Call on a gesture of the user. `rate` is the frame rate of the stream, Hz. sharesRoom: in AR the headset detects the
  // surfaces of the real room, which are drawn as shadows and go to the server (realRoom.shares). Ask the user first.
  enter(mode: Mode, rate: number, sharesRoom = false): Promise<void> {
    this.sharesRoom = sharesRoom;
    return this.immersion.enter(mode, rate, sharesRoom);
  }
  leave(): Promise<void> {
    return this.immersion.leave();
  }

  // Chooses what the next presses do.
  do(doing: Doing): void {
    this.firstPoint = undefined;
    this.hitTest.hide();
    this.doing = doing === "place" && !this.hitTest.looks ? "touch" : doing;
    if (doing === "place" && !this.hitTest.looks) this.placed = false;
    this.listener.doingChanged?.(this.doing);
  }

  slipped(grab: number): void {
    this.body.slipped(grab);
  }

  // Reads the poses and moves the scene; call first in each frame of a session. Without a client nothing is touched.
  update(frame: XRFrame, nowMs: number, client: Client | undefined): void {
    const { session } = this;
    const space = this.host.renderer.xr.getReferenceSpace();
    if (!session || !space) return;
    ++this.frames;
    if (session.visibilityState === "hidden") return;
    if (!this.placed) this.placeInFront(frame, space);
    this.body.update(frame, space, session, this.placement.inverse, nowMs);
    this.listener.updated?.();
    this.handlePresses(frame, space, client);
    const anchor = this.doing === "place" ? undefined : this.hitTest.anchored(frame, space);
    if (anchor) this.place(() => this.placement.moveTo(this.foot(), anchor));
    if (client) {
      this.body.grab(client.frames, this.placement.scale);
      this.body.send(client.input, this.placement.scale);
      this.wearer.send(client.wearing, this.body, frame, space, this.placement.inverse, this.placement.scale);
    }
    const isMoving = this.doing !== "touch" || this.move !== undefined || this.looksForSurfaces;
    this.realRoom.update(frame, space, this.placement, this.foot().applyMatrix4(this.placement.matrix), isMoving, client?.input.surfaces, nowMs);
    const hasFloor = this.realRoom.counts.detected > 0;
    if (hasFloor !== this.hasFloor) this.host.passThrough(this.passesThrough, (this.hasFloor = hasFloor));
    this.figures.place(this.body, this.placement.scale);
  }

  private handlePresses(frame: XRFrame, space: XRReferenceSpace, client: Client | undefined): void {
    if (this.doing === "place") this.hitTest.update(frame, space);
    for (const limb of this.body.present()) if (limb.isNew && this.takes(limb, client)) limb.isNew = false;
    if (this.doing === "place") {
      if (this.hitTest.reticle.visible) {
        const at = new THREE.Vector3().setFromMatrixPosition(this.hitTest.reticle.matrix);
        this.place(() => this.placement.moveTo(this.foot(), at));
      }
    }
    this.moveWithTwoHands();
  }

  // Whether a press is used for something other than the cloth.
  private takes(limb: Limb, client: Client | undefined): boolean {
    // A touch has priority over pointing.
    const reach = kReach / this.placement.scale;
    const touches = this.doing === "touch" && client?.frames.nearestPoint(limb.pose.point.toArray(), reach) !== undefined;
    if (!touches && this.listener.pressed?.(limb)) return true;
    if (this.doing === "touch") return false;
    if (this.doing === "place") {
      const isPlaced = this.hitTest.place() !== undefined;
      if (isPlaced) this.do("touch");
      return isPlaced;
    }
    const point = limb.pose.point.clone().applyMatrix4(this.placement.matrix);
    if (!this.firstPoint) {
      this.firstPoint = point;
    } else {
      const first = this.firstPoint;
      this.hitTest.dropAnchor();
      // Points that are too close to each other are asked for again.
      let far = false;
      this.place(() => (far = this.placement.setByTwoPoints(first, point)));
      this.do(far ? "touch" : "points");
    }
    return true;
  }

  // Two hands that press and hold no cloth move, turn and scale the scene.
  private moveWithTwoHands(): void {
    const free: Limb[] = [];
    for (const limb of this.body.present())
      if (limb.pressed && !limb.isNew && !limb.grabber.holds && limb.side !== "none") free.push(limb);
    const left = free.find(({ side }) => side === "left");
    const right = free.find(({ side }) => side === "right");
    if (!left || !right || this.doing !== "touch") {
      this.move = undefined;
      return;
    }
    const [a, b] = [this.inRoom(left), this.inRoom(right)];
    if (this.move?.left !== left || this.move.right !== right) {
      this.move = { hands: new TwoHandMove(this.placement, a, b), left, right };
      return;
    }
    this.hitTest.dropAnchor();
    const { hands } = this.move;
    this.place(() => hands.update(a, b));
  }

  private inRoom(limb: Limb): THREE.Vector3 {
    return limb.pose.point.clone().applyMatrix4(this.placement.matrix);
  }

  // Puts the front of the scene before the user, on the floor of the room.
  private placeInFront(frame: XRFrame, space: XRReferenceSpace): void {
    const viewer = frame.getViewerPose(space);
    if (!viewer) return;
    this.placed = true;
    const { position, orientation } = viewer.transform;
    const look = kForward.clone().applyQuaternion(new THREE.Quaternion(orientation.x, orientation.y, orientation.z, orientation.w));
    look.y = 0;
    if (look.lengthSq() < 1e-6) look.copy(kForward);
    look.normalize();
    const bounds = this.host.bounds();
    const front = new THREE.Vector3((bounds.min.x + bounds.max.x) / 2, bounds.min.y, bounds.max.z);
    const at = new THREE.Vector3(position.x, 0, position.z).addScaledVector(look, kArmLength);
    const turn = Math.atan2(-look.x, -look.z);
    this.seat.position.set(position.x, 0, position.z);
    this.seat.rotation.y = turn;
    this.place(() => {
      this.placement.set(new THREE.Vector3(), turn, 1);
      this.placement.moveTo(front, at);
    });
  }

  // Middle of the scene on its floor.
  private foot(): THREE.Vector3 {
    const bounds = this.host.bounds();
    return bounds.getCenter(new THREE.Vector3()).setY(bounds.min.y);
  }

  private place(change: () => void): void {
    change();
    this.host.scene.matrix.copy(this.placement.matrix);
    this.host.scene.matrixWorldNeedsUpdate = true;
    this.room.matrix.copy(this.placement.inverse);
  }

  private entered(mode: Mode, session: XRSession): void {
    const passThrough = mode === "immersive-ar" && session.environmentBlendMode !== "opaque";
    this.host.scene.matrixAutoUpdate = false;
    this.room.visible = this.figures.group.visible = true;
    this.passesThrough = passThrough;
    this.host.passThrough(passThrough, (this.hasFloor = false));
    if (mode === "immersive-ar" && this.sharesRoom) this.realRoom.begin(session);
    this.figures.passThrough = passThrough;
    this.placed = false;
    this.body.attach(session);
    const space = this.host.renderer.xr.getReferenceSpace();
    // The user has chosen a new origin or direction of the room.
    space?.addEventListener("reset", () => (this.placed = false));
    this.do("touch");
    this.looksForSurfaces = mode === "immersive-ar";
    if (this.looksForSurfaces)
      void this.hitTest
        .begin(session)
        .then(() => this.session === session && this.do("place"))
        .catch(() => undefined)
        .finally(() => (this.looksForSurfaces = false));
    this.listener.entered?.(mode);
  }

  private left(): void {
    this.host.change((input) => {
      this.body.leave(input);
      this.realRoom.end(input.surfaces);
    });
    this.hitTest.end();
    this.figures.clear();
    this.move = undefined;
    this.room.visible = this.figures.group.visible = false;
    this.host.passThrough(false, false);
    this.place(() => this.placement.set(new THREE.Vector3(), 0, 1));
    this.doing = "touch";
    this.listener.left?.();
  }
}
