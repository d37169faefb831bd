// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of participants, which cloth does not pass through: the own ones, and those of others.

import { CS_ROOM_SURFACE_VERSION, CS_SURFACE_VERSION, cs_room_surface, cs_surface } from "./layout";
import { readFloats, vec3, writeFloats, type CoreHandle } from "./handle";
import type { Quaternion, Vec3 } from "./types";

// Use that the server makes of surfaces.
export enum SurfacePolicy {
  unknown = 0, // not connected yet, or the server is of a release that knows no surfaces
  off = 1, // it refuses them
  own = 2, // they act on the cloth, and their shape is sent to no client
  everyone = 3, // they act on the cloth, and everyone in the scene gets their shape
}

// Surface of another participant.
export interface RoomSurface {
  participantId: bigint;
  id: number; // unique for its participant
  revision: bigint; // differs from that of every other mesh of the scene
  position: Vec3;
  orientation: Quaternion;
}

export interface Surface {
  id: number; // a known id replaces its surface
  positions: Float32Array; // x, y, z of each vertex, m, -100 to 100, in the frame of the surface
  triangles: Uint32Array; // three vertices of each triangle, counter-clockwise seen from the front
  position: Vec3;
  orientation: Quaternion;
  twoSided?: boolean; // cloth can be on both sides; else it passes the surface from behind. Default: false
  friction?: number; // 0 to 10, multiplied with the cloth's. Default: 1
}

// Triangles of one surface, at most.
export const kMostSurfaceTriangles = 50_000;

export class Surfaces {
  constructor(private readonly handle: CoreHandle) {}

  // Policy of the server that this client has joined.
  get policy(): SurfacePolicy {
    const { core, pointer } = this.handle;
    return core.exports.cs_get_surface_policy(pointer);
  }

  // Says how far the policy may go for surfaces to be sent: own (default) or everyone. Ask the user first.
  allow(policy: SurfacePolicy.own | SurfacePolicy.everyone): void {
    const { core, pointer } = this.handle;
    core.exports.cs_allow_surfaces(pointer, policy);
  }

  // Adds a surface, or replaces the one with its id. The mesh is sent in parts, and again after a reconnect. The former one
  // acts until it has arrived. Returns false if the server takes no surfaces, if its policy goes further than allow() says,
  // or if there are no or too many triangles.
  // SessionListener.refused reports other refusals with an error text that begins with "surface".
  set(surface: Surface): boolean {
    const { core, pointer } = this.handle;
    const { positions, triangles } = surface;
    const numbers = core.allocate(positions.byteLength + triangles.byteLength);
    const corners = numbers + positions.byteLength;
    core.floats(numbers, positions.length).set(positions);
    core.indices(corners, triangles.length).set(triangles);
    const at = this.handle.prepared(CS_SURFACE_VERSION);
    const view = core.view();
    view.setUint32(at + cs_surface.id, surface.id, true);
    writeFloats(view, at + cs_surface.position, surface.position);
    writeFloats(view, at + cs_surface.orientation, surface.orientation);
    view.setUint32(at + cs_surface.positions, numbers, true);
    view.setUint32(at + cs_surface.vertex_count, Math.floor(positions.length / 3), true);
    view.setUint32(at + cs_surface.triangles, corners, true);
    view.setUint32(at + cs_surface.triangle_count, Math.floor(triangles.length / 3), true);
    view.setUint32(at + cs_surface.two_sided, surface.twoSided ? 1 : 0, true);
    view.setFloat32(at + cs_surface.friction, surface.friction ?? 1, true);
    const isSet = core.exports.cs_set_surface(pointer, at) !== 0;
    core.exports.free(numbers);
    return isSet;
  }

  // Moves a surface, which stands in its new pose from the next tick on. Returns false if there is none with this id.
  move(id: number, position: Vec3, orientation: Quaternion): boolean {
    const { core, pointer } = this.handle;
    return core.with([position, orientation], (place, turn) => core.exports.cs_move_surface(pointer, id, place!, turn!) !== 0);
  }

  // Returns false if there is no surface with this id.
  remove(id: number): boolean {
    const { core, pointer } = this.handle;
    return core.exports.cs_remove_surface(pointer, id) !== 0;
  }

  // Gets the surfaces of others, if the policy is everyone. Default: off. SessionListener.surfacesChanged reports them.
  follow(on: boolean): void {
    const { core, pointer } = this.handle;
    core.exports.cs_follow_surfaces(pointer, on ? 1 : 0);
  }

  // Surfaces of others that have arrived.
  others(): RoomSurface[] {
    const { exports } = this.handle.core;
    return this.handle.list(exports.cs_room_surface_count(this.handle.pointer), CS_ROOM_SURFACE_VERSION, exports.cs_get_room_surface, (view, at) => ({
      participantId: view.getBigUint64(at + cs_room_surface.participant_id, true),
      id: view.getUint32(at + cs_room_surface.id, true),
      revision: view.getBigUint64(at + cs_room_surface.revision, true),
      position: vec3(view, at + cs_room_surface.position),
      orientation: readFloats<[number, number, number, number]>(view, at + cs_room_surface.orientation, [0, 0, 0, 0]),
    }));
  }

  // Copy of the mesh of a surface of others. Undefined if it is gone.
  mesh(revision: bigint): Pick<Surface, "positions" | "triangles"> | undefined {
    const { core, pointer } = this.handle;
    const at = this.handle.prepared(CS_ROOM_SURFACE_VERSION);
    for (let index = 0; core.exports.cs_get_room_surface(pointer, index, at) !== 0; ++index) {
      const view = core.view();
      if (view.getBigUint64(at + cs_room_surface.revision, true) !== revision) continue;
      const list = (pointerAt: number, countAt: number) => [view.getUint32(at + pointerAt, true), 3 * view.getUint32(at + countAt, true)] as const;
      const positions = core.floats(...list(cs_room_surface.positions, cs_room_surface.vertex_count)).slice();
      return { positions, triangles: core.indices(...list(cs_room_surface.triangles, cs_room_surface.triangle_count)).slice() };
    }
    return undefined;
  }
}
