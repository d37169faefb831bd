// SPDX-License-Identifier: MIT
// Drags a collider or the cloth by mouse, pen, finger or keys.

import * as THREE from "three";
import type { ClothPoint, Grab, Vec3 } from "@clothstream/client";
import { newGrabId } from "@clothstream/three";
import type { View } from "./view";

// New position of a collider, or of a grab on the cloth. An undefined grab releases the cloth.
export type DragTarget =
  | { kind: "collider"; collider: string; position: Vec3 }
  | { kind: "grab"; grab: Grab | undefined };

// A grab keeps the place that it took: it is needed again after a reconnect.
type Held = { collider: string } | { grab: number; place: Uint8Array };
type Hit = { point: THREE.Vector3; collider: string } | { point: THREE.Vector3; place: Uint8Array };

export class Drag {
  // False while nothing can be dragged.
  enabled = true;
  private readonly raycaster = new THREE.Raycaster();
  private readonly plane = new THREE.Plane();
  private readonly offset = new THREE.Vector3(); // from the pointer to the dragged point
  private held: Held | undefined;
  private wanted: THREE.Vector3 | undefined;
  private released = false;
  private pointer: number | undefined;

  // `castRay` finds the cloth under the pointer. `grabbed` receives the name of each collider that the user starts to
  // drag.
  constructor(
    private readonly view: View,
    private readonly castRay: (origin: Vec3, direction: Vec3) => ClothPoint | undefined,
    private readonly grabbed: (collider: string) => void,
  ) {
    const canvas = view.canvas;
    // Capture phase, so that a press on a collider or the cloth does not turn the camera.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, (event) => this.release(event));
  }

  // Returns the new target if it changed since the last call. Call once per drawn frame.
  take(): DragTarget | undefined {
    if (this.released) {
      this.released = false;
      return { kind: "grab", grab: undefined };
    }
    if (!this.held || !this.wanted) return undefined;
    const position: Vec3 = [this.wanted.x, this.wanted.y, this.wanted.z];
    this.wanted = undefined;
    if ("collider" in this.held) return { kind: "collider", collider: this.held.collider, position };
    return { kind: "grab", grab: { id: this.held.grab, position, place: this.held.place } };
  }

  // Ends a grab that slipped off the cloth.
  slipped(grab: number): void {
    if (!this.held || !("grab" in this.held) || this.held.grab !== grab) return;
    this.held = undefined;
    this.released = true;
    this.view.canvas.style.cursor = "";
  }

  // Moves a collider in the plane that faces the camera, in metres; for keys.
  nudge(name: string, right: number, up: number): void {
    const collider = this.view.colliders.find((candidate) => candidate.name === name);
    if (!this.enabled || !collider || this.pointer !== undefined) return;
    const isHeld = this.held && "collider" in this.held && this.held.collider === name;
    const from = isHeld && this.wanted ? this.wanted : collider.position;
    this.wanted = from.clone().add(this.view.inViewPlane(right, up));
    this.held = { collider: name };
  }

  private press(event: PointerEvent): void {
    if (event.button !== 0 || this.pointer !== undefined || this.view.fingers.areTwo) return;
    this.aim(event);
    const hit = this.pick();
    if (!hit) return;
    event.stopImmediatePropagation();
    this.view.canvas.setPointerCapture(event.pointerId);
    this.view.canvas.focus();
    this.view.canvas.style.cursor = "grabbing";
    const centre = hit.point;
    const facing = this.view.camera.getWorldDirection(new THREE.Vector3());
    this.plane.setFromNormalAndCoplanarPoint(facing, centre);
    // The pointer keeps its offset from the dragged point.
    const start = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
    this.offset.copy(centre).sub(start ?? centre);
    this.pointer = event.pointerId;
    this.released = false;
    this.wanted = centre.clone();
    if ("collider" in hit) {
      this.held = { collider: hit.collider };
      this.grabbed(hit.collider);
    } else {
      this.held = { grab: newGrabId(), place: hit.place };
    }
  }

  private move(event: PointerEvent): void {
    this.aim(event);
    if (event.pointerId === this.pointer) {
      if (!this.held) return;
      const point = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
      if (point) this.wanted = point.add(this.offset);
    } else if (event.pointerType === "mouse" && event.buttons === 0) {
      this.view.canvas.style.cursor = this.pick() ? "grab" : "";
    }
  }

  private release(event: PointerEvent): void {
    if (event.pointerId !== this.pointer) return;
    this.pointer = undefined;
    this.view.canvas.style.cursor = "";
    if (this.held && "grab" in this.held) {
      this.held = undefined;
      this.released = true;
    }
  }

  // Finds the nearest collider of the scene or cloth under the pointer. A collider is dragged by its centre.
  private pick(): Hit | undefined {
    if (!this.enabled) return undefined;
    const collider = this.raycaster
      .intersectObjects<THREE.Object3D>([...this.view.colliders], false)
      .find(({ object }) => object.name !== "");
    const { origin, direction } = this.raycaster.ray;
    const cloth = this.castRay([origin.x, origin.y, origin.z], [direction.x, direction.y, direction.z]);
    if (cloth && (!collider || cloth.distance < collider.distance))
      return { point: new THREE.Vector3(...cloth.position), place: cloth.place };
    return collider && { point: collider.object.position, collider: collider.object.name };
  }

  private aim(event: PointerEvent): void {
    const frame = this.view.canvas.getBoundingClientRect();
    const point = new THREE.Vector2(
      (2 * (event.clientX - frame.left)) / frame.width - 1,
      1 - (2 * (event.clientY - frame.top)) / frame.height,
    );
    this.raycaster.setFromCamera(point, this.view.camera);
  }
}
