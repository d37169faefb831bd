// SPDX-License-Identifier: MIT
// Takes hold of a collider with mouse, pen, finger or keys, and says where it is to go.

import * as THREE from "three";
import type { Vec3 } from "./client";
import type { View } from "./view";

export class ColliderDrag {
  private readonly raycaster = new THREE.Raycaster();
  private readonly plane = new THREE.Plane();
  private readonly grip = new THREE.Vector3();
  private held: string | undefined;
  private wanted: THREE.Vector3 | undefined;
  private pointer: number | undefined;

  // `grabbed` is told the name of each collider that is taken.
  constructor(
    private readonly view: View,
    private readonly grabbed: (collider: string) => void,
  ) {
    const canvas = view.canvas;
    // Capturing, so that a press on a collider never reaches the camera.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, (event) => this.release(event));
  }

  // Where the held collider is to be, if that changed since the last call. To be asked once a drawn frame.
  take(): { collider: string; position: Vec3 } | undefined {
    if (this.held === undefined || !this.wanted) return undefined;
    const { x, y, z } = this.wanted;
    this.wanted = undefined;
    return { collider: this.held, position: [x, y, z] };
  }

  // For keys: moves a collider in the camera-facing plane, metres.
  nudge(name: string, right: number, up: number): void {
    const collider = this.view.colliders.find((candidate) => candidate.name === name);
    if (!collider || this.pointer !== undefined) return;
    const from = this.held === name && this.wanted ? this.wanted : collider.position;
    this.wanted = from.clone().add(this.view.inViewPlane(right, up));
    this.held = name;
  }

  private press(event: PointerEvent): void {
    if (event.button !== 0 || this.pointer !== undefined) return;
    this.aim(event);
    const hit = this.raycaster.intersectObjects([...this.view.colliders], false).find(({ object }) => object.name !== "");
    if (!hit) return;
    event.stopImmediatePropagation();
    this.view.canvas.setPointerCapture(event.pointerId);
    this.view.canvas.focus();
    this.view.canvas.style.cursor = "grabbing";
    const facing = this.view.camera.getWorldDirection(new THREE.Vector3());
    this.plane.setFromNormalAndCoplanarPoint(facing, hit.object.position);
    // The pointer stays where it took hold of the collider.
    const start = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
    this.grip.copy(hit.object.position).sub(start ?? hit.object.position);
    this.pointer = event.pointerId;
    this.held = hit.object.name;
    this.wanted = hit.object.position.clone();
    this.grabbed(this.held);
  }

  private move(event: PointerEvent): void {
    this.aim(event);
    if (event.pointerId === this.pointer) {
      const point = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
      if (point) this.wanted = point.add(this.grip);
    } else if (event.pointerType === "mouse" && event.buttons === 0) {
      const over = this.raycaster.intersectObjects([...this.view.colliders], false).some(({ object }) => object.name !== "");
      this.view.canvas.style.cursor = over ? "grab" : "";
    }
  }

  private release(event: PointerEvent): void {
    if (event.pointerId !== this.pointer) return;
    this.pointer = undefined;
    this.view.canvas.style.cursor = "";
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
