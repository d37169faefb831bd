// SPDX-License-Identifier: MIT
// The user of a headset as colliders and grabs of the scene: hands, controllers and head.

import * as THREE from "three";
import { HandSide, Shape, type Grab, type Head, type Input, type OwnCollider } from "@clothstream/client";
import { heldFan } from "../fan";
import { kReach, type Touchable } from "./grabber";
import { Limb } from "./limb";

const kHeadRadius = 0.11; // m of the room
const kControllerRadius = 0.045;
const kMostLimbs = 8;

export class Body {
  readonly head = new THREE.Vector3();
  // Orientation of the head in the scene.
  readonly headOrientation = new THREE.Quaternion();
  private readonly turn = new THREE.Quaternion(); // from the room to the scene
  headPresent = false;
  private readonly rotation = new THREE.Matrix4();
  private readonly limbs = new Map<string, Limb>();
  private readonly sides = { left: false, right: false }; // hands that the server has
  private collides = false; // whether the server has colliders
  private heads = false; // whether the server has the head
  private grabs = 0; // number of grabs that the server has
  private blows = false; // whether the server has the fan
  // Whether the user holds a fan. It blows where its hand or controller points.
  holdsFan = false;
  private readonly limbOf = new Map<XRInputSource, Limb>();

  // Inputs that are there or were a moment ago.
  *present(): Iterable<Limb> {
    for (const limb of this.limbs.values()) if (limb.present) yield limb;
  }

  // The right hand or controller that holds the fan, or else the left one.
  get fanHolder(): Limb | undefined {
    if (!this.holdsFan) return undefined;
    const holders = [...this.present()].filter(({ side, pose }) => side !== "none" && pose.ray);
    return holders.find(({ side }) => side === "right") ?? holders[0];
  }

  // Listens to presses of a session. Pinches and triggers are `select`, grips are `squeeze`.
  attach(session: XRSession): void {
    const press = ({ inputSource }: XRInputSourceEvent) => this.limb(inputSource)?.press();
    const release = ({ inputSource }: XRInputSourceEvent) => this.limb(inputSource)?.release();
    session.addEventListener("selectstart", press);
    session.addEventListener("selectend", release);
    session.addEventListener("squeezestart", press);
    session.addEventListener("squeezeend", release);
  }

  // Reads all poses. `toScene` leads from the reference space to the scene.
  update(frame: XRFrame, space: XRReferenceSpace, session: XRSession, toScene: THREE.Matrix4, nowMs: number): void {
    const viewer = frame.getViewerPose(space);
    this.headPresent = viewer !== undefined && viewer !== null;
    if (viewer) {
      const { x, y, z } = viewer.transform.position;
      this.head.set(x, y, z).applyMatrix4(toScene);
      const { orientation } = viewer.transform;
      this.headOrientation.set(orientation.x, orientation.y, orientation.z, orientation.w);
      this.headOrientation.premultiply(this.turn.setFromRotationMatrix(this.rotation.extractRotation(toScene)));
    }
    this.limbOf.clear();
    for (const source of session.inputSources) this.limb(source);
    for (const limb of this.limbs.values()) limb.update(frame, space, sourceOf(this.limbOf, limb), toScene, nowMs);
  }

  // Takes hold of the cloth with each input that was pressed since the last frame.
  // `scale` is metres of the room per metre of the scene.
  grab(cloth: Touchable, scale: number): void {
    for (const limb of this.present()) {
      if (limb.isNew) limb.grabber.take(limb.pose, cloth, kReach / scale);
      limb.isNew = false;
    }
  }

  // Lets go of all cloth, for example because another scene follows.
  letGo(): void {
    for (const limb of this.limbs.values()) limb.grabber.release();
  }

  slipped(grab: number): void {
    for (const limb of this.limbs.values()) limb.grabber.slipped(grab);
  }

  // Sends colliders, hands, grabs and the fan. `scale` is metres of the room per metre of the scene.
  send(input: Input, scale: number): void {
    const colliders: OwnCollider[] = [];
    const grabs: Grab[] = [];
    const hands = { left: false, right: false };
    for (const limb of this.present()) {
      const grab = limb.grabber.grab(limb.pose);
      if (grab) grabs.push(grab);
      if (!limb.isHand) {
        if (limb.side !== "none") colliders.push(sphere(limb.pose.point, kControllerRadius / scale));
      } else if (limb.side !== "none") {
        hands[limb.side] = true;
        input.setHand(kSides[limb.side], limb.hand.joints);
      }
    }
    for (const side of ["left", "right"] as const) {
      if (this.sides[side] && !hands[side]) input.setHand(kSides[side], undefined);
      this.sides[side] = hands[side];
    }
    if (this.headPresent || this.heads) input.setHead(this.headPresent ? this.ownHead(scale) : undefined);
    this.heads = this.headPresent;
    if (colliders.length > 0 || this.collides) input.setColliders(colliders);
    this.collides = colliders.length > 0;
    if (grabs.length > 0 || this.grabs > 0) input.setGrabs(grabs);
    this.grabs = grabs.length;
    const holder = this.fanHolder?.pose;
    if (holder?.ray || this.blows) input.setWinds(holder?.ray ? [heldFan(holder.point, holder.ray.direction, 1 / scale)] : []);
    this.blows = holder?.ray !== undefined;
  }

  // Removes everything from the scene, at the end of a session.
  leave(input: Input): void {
    this.limbs.clear();
    this.headPresent = false;
    this.send(input, 1);
  }

  private ownHead(scale: number): Head {
    const { x, y, z, w } = this.headOrientation;
    return { position: this.head.toArray(), orientation: [x, y, z, w], radius: kHeadRadius / scale };
  }

  private limb(source: XRInputSource): Limb | undefined {
    const isHand = source.hand !== undefined && source.hand !== null;
    const key = `${source.handedness} ${isHand ? "hand" : source.targetRayMode}`;
    let limb = this.limbs.get(key);
    if (!limb) {
      if (this.limbs.size >= kMostLimbs) return undefined;
      limb = new Limb(source.handedness, isHand);
      this.limbs.set(key, limb);
    }
    this.limbOf.set(source, limb);
    return limb;
  }
}

const kSides = { left: HandSide.left, right: HandSide.right };

function sphere(position: THREE.Vector3, radius: number): OwnCollider {
  return { shape: Shape.sphere, position: position.toArray(), radius };
}

function sourceOf(limbOf: ReadonlyMap<XRInputSource, Limb>, wanted: Limb): XRInputSource | undefined {
  for (const [source, limb] of limbOf) if (limb === wanted) return source;
  return undefined;
}
