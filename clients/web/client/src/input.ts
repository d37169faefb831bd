// SPDX-License-Identifier: MIT
// Colliders, hands, grabs and surfaces of this participant, and joints of the scene's colliders.

import { CS_GRAB_EVENT_VERSION, CS_GRAB_VERSION, CS_OWN_COLLIDER_VERSION, CS_OWN_WIND_VERSION, cs_cloth_point, cs_grab, cs_grab_event, cs_own_collider, cs_own_wind } from "./layout";
import { nowUs, writeFloats, type CoreHandle } from "./handle";
import { Surfaces } from "./surfaces";
import { HandSide, kMaxColliders, kMaxGrabs, kMaxWinds, type Grab, type GrabEvent, type Head, type OwnCollider, type OwnWind } from "./types";

const kJointFloats = 4; // x, y, z, radius
const kHandJoints = 25; // of WebXR
const kPoseFloats = 7; // position, quaternion x, y, z, w

// Events of all participants' grabs in the newest ClientEvent.grabs.
export function readGrabEvents(handle: CoreHandle): (GrabEvent & { participant: bigint })[] {
  const { core, pointer } = handle;
  return handle.list(core.exports.cs_grab_event_count(pointer), CS_GRAB_EVENT_VERSION, core.exports.cs_get_grab_event, (view, at) => ({
    participant: view.getBigUint64(at + cs_grab_event.participant_id, true),
    grab: view.getUint32(at + cs_grab_event.grab_id, true),
    vertices: view.getUint32(at + cs_grab_event.vertices, true),
    distance: view.getFloat32(at + cs_grab_event.distance, true),
    ticksSinceSeen: Number(view.getBigUint64(at + cs_grab_event.ticks_since_seen, true)),
  }));
}

export class Input {
  // Surfaces of the real room.
  readonly surfaces: Surfaces;
  // Arrays of structs for a call: as large as the largest of them. Places of grabs follow the grabs.
  private readonly array: number;

  constructor(private readonly handle: CoreHandle) {
    this.surfaces = new Surfaces(handle);
    this.array = handle.core.allocate(
      Math.max(kMaxColliders * cs_own_collider.sizeof, kMaxGrabs * (cs_grab.sizeof + cs_cloth_point.sizeof), kHandJoints * kJointFloats * 4),
    );
  }

  // Events of this participant's grabs in the newest ClientEvent.grabs.
  grabEvents(): GrabEvent[] {
    const { core, pointer } = this.handle;
    const own = core.exports.cs_participant_id(pointer);
    return readGrabEvents(this.handle).filter(({ participant }) => participant === own);
  }

  // Sets all grabs of this participant; a missing one releases. A new id starts a new grab.
  setGrabs(grabs: readonly Grab[]): void {
    const { core, pointer } = this.handle;
    const view = core.view();
    grabs.slice(0, kMaxGrabs).forEach((grab, index) => {
      const at = this.array + index * cs_grab.sizeof;
      const place = this.array + kMaxGrabs * cs_grab.sizeof + index * cs_cloth_point.sizeof;
      view.setUint32(at + cs_grab.version, CS_GRAB_VERSION, true);
      view.setUint32(at + cs_grab.id, grab.id, true);
      writeFloats(view, at + cs_grab.position, grab.position);
      writeFloats(view, at + cs_grab.orientation, grab.orientation ?? kNoRotation);
      // NaN: the server's default.
      for (const offset of [cs_grab.radius, cs_grab.reach, cs_grab.max_force, cs_grab.slip_distance])
        view.setFloat32(at + offset, NaN, true);
      view.setUint32(at + cs_grab.place, place, true);
      core.bytes(place, cs_cloth_point.sizeof).set(grab.place);
    });
    core.exports.cs_set_grabs(pointer, this.array, Math.min(grabs.length, kMaxGrabs), nowUs());
  }

  // Replaces the colliders of this participant, except its hands and its head.
  setColliders(colliders: readonly OwnCollider[]): void {
    const { core, pointer } = this.handle;
    const view = core.view();
    colliders.slice(0, kMaxColliders).forEach((collider, index) => {
      const at = this.array + index * cs_own_collider.sizeof;
      view.setUint32(at + cs_own_collider.version, CS_OWN_COLLIDER_VERSION, true);
      view.setUint32(at + cs_own_collider.shape, collider.shape, true);
      writeFloats(view, at + cs_own_collider.position, collider.position);
      writeFloats(view, at + cs_own_collider.orientation, collider.orientation ?? kNoRotation);
      view.setFloat32(at + cs_own_collider.radius, collider.radius ?? 0, true);
      view.setFloat32(at + cs_own_collider.top_radius, collider.topRadius ?? 0, true);
      view.setFloat32(at + cs_own_collider.length, collider.length ?? 0, true);
      writeFloats(view, at + cs_own_collider.size, collider.size ?? kNoSize);
    });
    core.exports.cs_set_colliders(pointer, this.array, Math.min(colliders.length, kMaxColliders), nowUs());
  }

  // Replaces the local winds of this participant. The server refuses them without the permission to change the environment.
  setWinds(winds: readonly OwnWind[]): void {
    const { core, pointer } = this.handle;
    const view = core.view();
    winds.slice(0, kMaxWinds).forEach((wind, index) => {
      const at = this.array + index * cs_own_wind.sizeof;
      view.setUint32(at + cs_own_wind.version, CS_OWN_WIND_VERSION, true);
      view.setUint32(at + cs_own_wind.kind, wind.kind, true);
      writeFloats(view, at + cs_own_wind.position, wind.position);
      writeFloats(view, at + cs_own_wind.orientation, wind.orientation ?? kNoRotation);
      view.setFloat32(at + cs_own_wind.speed, wind.speed, true);
      // NaN: the server's default.
      view.setFloat32(at + cs_own_wind.radius, wind.radius ?? NaN, true);
      view.setFloat32(at + cs_own_wind.spread, wind.spread ?? NaN, true);
      view.setFloat32(at + cs_own_wind.reach, wind.reach ?? NaN, true);
    });
    core.exports.cs_set_winds(pointer, this.array, Math.min(winds.length, kMaxWinds), nowUs());
  }

  // Replaces one tracked hand by 25 joints in the order of XRHand: x, y, z, radius of each. Undefined removes it.
  setHand(side: HandSide, joints: Float32Array | undefined): void {
    const { core, pointer } = this.handle;
    if (joints) core.floats(this.array, kHandJoints * kJointFloats).set(joints);
    core.exports.cs_set_hand(pointer, side, this.array, joints ? kHandJoints : 0, nowUs());
  }

  // Replaces the head, a sphere. The direction of its look is its own -Z axis. Undefined removes it.
  setHead(head: Head | undefined): void {
    const { core, pointer } = this.handle;
    if (!head) return core.exports.cs_set_head(pointer, 0, 0, 0, nowUs());
    core.with([head.position, head.orientation], (position, orientation) =>
      core.exports.cs_set_head(pointer, position!, orientation!, head.radius, nowUs()),
    );
  }

  // Moves the joints of a collider of the scene that is a mesh with joints; they stay there. `poses` has seven numbers for
  // each joint: position, then the quaternion x, y, z, w, relative to the parent. If they jump, they are there in one
  // tick, and the cloth that follows them goes along: use this for teleports and cuts of an animation.
  moveJoints(collider: string, poses: readonly number[] | Float32Array, jumps = false): void {
    const { core, pointer } = this.handle;
    core.with([collider, Array.from(poses)], (name, numbers) =>
      core.exports.cs_move_joints(
        pointer,
        name!,
        numbers!,
        Math.floor(poses.length / kPoseFloats),
        jumps ? 1 : 0,
        nowUs(),
      ),
    );
  }

  destroy(): void {
    this.handle.core.exports.free(this.array);
  }
}

const kNoRotation = [0, 0, 0, 0] as const;
const kNoSize = [0, 0, 0] as const;
