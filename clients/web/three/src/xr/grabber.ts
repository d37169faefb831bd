// SPDX-License-Identifier: MIT
// Takes hold of the cloth with one hand, controller or ray, and holds it.

import * as THREE from "three";
import type { ClothPoint, Grab, Vec3 } from "@clothstream/client";

// Largest distance from a hand to the cloth that it takes hold of, m of the room: the default of Grab.reach in session.proto. The
// fingers themselves keep the cloth 5 to 6 cm away from where they meet.
export const kReach = 0.1;

// Finds points of the shown cloth. Frames of the client package is one.
export interface Touchable {
  nearestPoint(point: Vec3, maxDistance: number): ClothPoint | undefined;
  castRay(origin: Vec3, direction: Vec3): ClothPoint | undefined;
}

// Pose of what grabs, in scene coordinates.
export interface GrabPose {
  point: THREE.Vector3; // where the fingers meet, or the middle of a controller
  orientation: THREE.Quaternion;
  ray: THREE.Ray | undefined; // with which the user points
}

let lastId = 0;

// Id for a new grab. All grabs of a participant share these ids, whatever they are made with.
export function newGrabId(): number {
  return ++lastId;
}

export class Grabber {
  private id = 0; // 0: holds nothing
  private place: Uint8Array = new Uint8Array();
  private distance: number | undefined; // along the ray; undefined: in the hand
  private readonly offset = new THREE.Vector3(); // from the hand to the held place, in the frame of the hand
  private readonly start = new THREE.Quaternion(); // inverse orientation of the hand at the start
  private readonly position = new THREE.Vector3();
  private readonly turned = new THREE.Quaternion();

  get holds(): boolean {
    return this.id !== 0;
  }

  isGrab(id: number): boolean {
    return this.holds && this.id === id;
  }

  // Takes hold of the cloth within `reach` of the hand, or else under the ray. Returns whether there is any.
  take(pose: GrabPose, cloth: Touchable, reach: number): boolean {
    this.release();
    const near = cloth.nearestPoint(pose.point.toArray(), reach);
    const far = near || !pose.ray ? undefined : cloth.castRay(pose.ray.origin.toArray(), pose.ray.direction.toArray());
    const found = near ?? far;
    if (!found) return false;
    this.id = newGrabId();
    this.place = found.place;
    this.distance = far?.distance;
    this.start.copy(pose.orientation).invert();
    this.offset.fromArray(found.position).sub(pose.point).applyQuaternion(this.start);
    return true;
  }

  release(): void {
    this.id = 0;
  }

  // Ends the grab if it has this id: it slipped.
  slipped(id: number): void {
    if (this.isGrab(id)) this.release();
  }

  // The grab for this pose; undefined without one. What a hand holds turns with it.
  grab(pose: GrabPose): Grab | undefined {
    if (!this.holds) return undefined;
    if (this.distance !== undefined && pose.ray) {
      pose.ray.at(this.distance, this.position);
      return { id: this.id, position: this.position.toArray(), place: this.place };
    }
    this.position.copy(this.offset).applyQuaternion(pose.orientation).add(pose.point);
    this.turned.copy(pose.orientation).multiply(this.start);
    const { x, y, z, w } = this.turned;
    return { id: this.id, position: this.position.toArray(), orientation: [x, y, z, w], place: this.place };
  }
}
