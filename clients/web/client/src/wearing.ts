// SPDX-License-Identifier: MIT
// Bodies of the scene that participants wear: colliders with joints that follow the head and hands of a person.

import { CS_TRACKED_BODY_VERSION, cs_tracked_body } from "./layout";
import { nowUs, writeFloats, type CoreHandle } from "./handle";
import type { Quaternion, Vec3 } from "./types";

// cs_body_part of core.h.
export enum BodyPart {
  head = 1,
  leftHand = 2,
  rightHand = 4,
  hips = 8,
  leftElbow = 16,
  rightElbow = 32,
  leftAnkle = 64,
  rightAnkle = 128,
}

export interface BodyPose {
  position: Vec3;
  orientation: Quaternion;
}

// Known parts of a person, in the scene, metres. Parts that are not tracked are left out.
export interface TrackedBody {
  floor: number; // height
  head: BodyPose; // between the eyes; looks along -Z
  // Wrists: the fingers point along -Z, and the back of the hand to +Y.
  leftHand?: BodyPose;
  rightHand?: BodyPose;
  // Parts that body tracking gives.
  hips?: Vec3;
  leftElbow?: Vec3;
  rightElbow?: Vec3;
  leftAnkle?: Vec3;
  rightAnkle?: Vec3;
}

export class Wearing {
  // Whether this client moves a body: from wear() until it is given back, or follow() finds that it is lost.
  isWearing = false;

  constructor(private readonly handle: CoreHandle) {}

  // Whether the collider with this index is a human body.
  isBody(collider: number): boolean {
    return this.handle.core.exports.cs_is_body(this.handle.pointer, collider) !== 0;
  }

  // Takes a body of the scene, or gives the own one back. Everyone's participants change, or ClientEvent.error follows.
  // Returns false if there is no such body.
  wear(collider: string | undefined): boolean {
    const { core, pointer } = this.handle;
    const taken = core.with([collider ?? ""], (name) => core.exports.cs_wear(pointer, name!)) !== 0;
    if (taken) this.isWearing = collider !== undefined;
    return taken;
  }

  // Name of the collider that a participant wears; "" for none.
  bodyOf(participant: bigint): string {
    return this.handle.core.text(this.handle.core.exports.cs_body_of(this.handle.pointer, participant));
  }
  // Name of the collider that this participant wears, as the server says; "" for none.
  get own(): string {
    const { core, pointer } = this.handle;
    return this.bodyOf(core.exports.cs_participant_id(pointer));
  }

  // Bends the own body to the person, and sends it. Call it once for each drawn frame. Returns false without a body.
  follow(tracked: TrackedBody): boolean {
    const { core, pointer } = this.handle;
    const at = this.handle.prepared(CS_TRACKED_BODY_VERSION);
    const view = core.view();
    let parts = 0;
    const pose = (part: BodyPart, offset: number, from: BodyPose | undefined) => {
      if (!from) return;
      parts |= part;
      writeFloats(view, at + offset, from.position);
      writeFloats(view, at + offset + 12, from.orientation);
    };
    const point = (part: BodyPart, offset: number, from: Vec3 | undefined) => {
      if (!from) return;
      parts |= part;
      writeFloats(view, at + offset, from);
    };
    pose(BodyPart.head, cs_tracked_body.head, tracked.head);
    pose(BodyPart.leftHand, cs_tracked_body.left_hand, tracked.leftHand);
    pose(BodyPart.rightHand, cs_tracked_body.right_hand, tracked.rightHand);
    point(BodyPart.hips, cs_tracked_body.hips, tracked.hips);
    point(BodyPart.leftElbow, cs_tracked_body.left_elbow, tracked.leftElbow);
    point(BodyPart.rightElbow, cs_tracked_body.right_elbow, tracked.rightElbow);
    point(BodyPart.leftAnkle, cs_tracked_body.left_ankle, tracked.leftAnkle);
    point(BodyPart.rightAnkle, cs_tracked_body.right_ankle, tracked.rightAnkle);
    view.setUint32(at + cs_tracked_body.parts, parts, true);
    view.setFloat32(at + cs_tracked_body.floor, tracked.floor, true);
    this.isWearing = core.exports.cs_set_body(pointer, at, nowUs()) !== 0;
    return this.isWearing;
  }

  // Where the newest follow() has put a part; undefined before.
  part(part: BodyPart): BodyPose | undefined {
    const { core, pointer, scratch } = this.handle;
    if (core.exports.cs_get_body_part(pointer, part, scratch) === 0) return undefined;
    const [x, y, z, a, b, c, d] = core.floats(scratch, 7);
    return { position: [x!, y!, z!], orientation: [a!, b!, c!, d!] };
  }

  // Corners of the triangles of a body below its neck; none if the collider with this index is not a body.
  belowNeck(collider: number): Uint32Array<ArrayBuffer> {
    const { core, pointer, scratch } = this.handle;
    const corners = core.exports.cs_body_below_neck(pointer, collider, scratch);
    return new Uint32Array(core.indices(corners, core.view().getUint32(scratch, true)));
  }
}
