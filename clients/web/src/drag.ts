// SPDX-License-Identifier: MIT
// Takes hold of a collider or of the cloth with mouse, pen, finger or keys, and says where that is to go.

import * as THREE from "three";
import type { Vec3 } from "./client";
import type { View } from "./view";

// Of a collider its place; of a grab on the cloth its place too, or nothing when it lets go.
export type DragTarget =
  | { kind: "collider"; collider: string; position: Vec3 }
  | { kind: "grab"; grab: { id: number; position: Vec3 } | undefined };

type Held = { collider: string } | { grab: number };

export class Drag {
  // Whether anything can be taken.
  enabled = true;
  private readonly raycaster = new THREE.Raycaster();
  private readonly plane = new THREE.Plane();
  private readonly grab = new THREE.Vector3();
  private held: Held | undefined;
  private wanted: THREE.Vector3 | undefined;
  private lets = false;
  private pointer: number | undefined;
  private grabs = 0;

  // `grabbed` is told the name of each collider that is taken.
  constructor(
    private readonly view: View,
    private readonly grabbed: (collider: string) => void,
  ) {
    const canvas = view.canvas;
    // Capturing, so that a press on what can be taken never reaches the camera.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, (event) => this.release(event));
  }

  // Where what is held is to be, if that changed since the last call. To be asked once a drawn frame.
  take(): DragTarget | undefined {
    if (this.lets) {
      this.lets = false;
      return { kind: "grab", grab: undefined };
    }
    if (!this.held || !this.wanted) return undefined;
    const position: Vec3 = [this.wanted.x, this.wanted.y, this.wanted.z];
    this.wanted = undefined;
    if ("collider" in this.held) return { kind: "collider", collider: this.held.collider, position };
    return { kind: "grab", grab: { id: this.held.grab, position } };
  }

  // That grab holds nothing any more.
  slipped(grab: number): void {
    if (!this.held || !("grab" in this.held) || this.held.grab !== grab) return;
    this.held = undefined;
    this.lets = true;
    this.view.canvas.style.cursor = "";
  }

  // For keys: moves a collider in the camera-facing plane, metres.
  nudge(name: string, right: number, up: number): void {
    const collider = this.view.colliders.find((candidate) => candidate.name === name);
    if (!this.enabled || !collider || this.pointer !== undefined) return;
    const isHeld = this.held && "collider" in this.held && this.held.collider === name;
    const from = isHeld && this.wanted ? this.wanted : collider.position;
    this.wanted = from.clone().add(this.view.inViewPlane(right, up));
    this.held = { collider: name };
  }

  private press(event: PointerEvent): void {
    if (event.button !== 0 || this.pointer !== undefined) return;
    this.aim(event);
    const hit = this.pick();
    if (!hit) return;
    event.stopImmediatePropagation();
    this.view.canvas.setPointerCapture(event.pointerId);
    this.view.canvas.focus();
    this.view.canvas.style.cursor = "grabbing";
    // A collider is held by its centre, cloth where the pointer is on it.
    const centre = hit.collider ? hit.object.position : hit.point;
    const facing = this.view.camera.getWorldDirection(new THREE.Vector3());
    this.plane.setFromNormalAndCoplanarPoint(facing, centre);
    // The pointer stays where it took hold.
    const start = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
    this.grab.copy(centre).sub(start ?? centre);
    this.pointer = event.pointerId;
    this.lets = false;
    this.wanted = centre.clone();
    if (hit.collider) {
      this.held = { collider: hit.collider };
      this.grabbed(hit.collider);
    } else {
      this.held = { grab: ++this.grabs };
    }
  }

  private move(event: PointerEvent): void {
    this.aim(event);
    if (event.pointerId === this.pointer) {
      if (!this.held) return;
      const point = this.raycaster.ray.intersectPlane(this.plane, new THREE.Vector3());
      if (point) this.wanted = point.add(this.grab);
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
      this.lets = true;
    }
  }

  // What lies foremost under the pointer and can be taken: a collider of the scene, or cloth.
  private pick(): { object: THREE.Object3D; point: THREE.Vector3; collider: string | undefined } | undefined {
    if (!this.enabled) return undefined;
    const cloths = this.view.clothMeshes;
    const hit = this.raycaster
      .intersectObjects<THREE.Object3D>([...this.view.colliders, ...cloths], false)
      .find(({ object }) => object.name !== "" || cloths.includes(object as THREE.Mesh));
    if (!hit) return undefined;
    return { object: hit.object, point: hit.point, collider: hit.object.name || undefined };
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
