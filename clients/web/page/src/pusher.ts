// SPDX-License-Identifier: MIT
// A ball, a box or a fan of the user, moved by mouse or finger. A ball or box follows the pointer along the cloth, and a
// press pushes it in. A fan blows at what is under the pointer, and a press makes it stronger.

import * as THREE from "three";
import { Shape, type ClothPoint, type Input, type OwnCollider, type OwnWind, type Vec3 } from "@clothstream/client";
import { FanFigure, heldFan } from "@clothstream/three";
import type { View } from "./view";

export type Tool = "hand" | "ball" | "box" | "fan";

// Largest speed, m/s. The server takes faster motion for a jump above 30 m/s.
const kSpeed = 3;
// Depth behind the touched point to which a press pushes, in radii.
const kPush = 1.6;
const kLongestStep = 0.1; // s
const kFanDistance = 0.7; // m, from the touched point to the fan
const kStrong = 2; // strength of the fan while it is pressed
const kNoColliders: readonly OwnCollider[] = [];
const kNoWinds: readonly OwnWind[] = [];

export class Pusher {
  radius = 0.12; // of the ball, and half the edge of the box, m
  private chosen: Tool = "hand";
  private readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private readonly raycaster = new THREE.Raycaster();
  private readonly goal = new THREE.Vector3();
  private readonly plane = new THREE.Plane();
  private readonly pointer = new THREE.Vector2();
  private isOver = false;
  private pushes = false;
  private placed = false; // whether the collider is in the scene
  private drawnAt = 0; // ms
  private sent = false; // whether the server has the collider
  private blows = false; // whether the server has the fan
  private readonly fan = new FanFigure();

  // `castRay` finds the cloth under the pointer.
  constructor(
    private readonly view: View,
    private readonly castRay: (origin: Vec3, direction: Vec3) => ClothPoint | undefined,
  ) {
    const material = new THREE.MeshStandardMaterial({ color: 0xe2a04a, roughness: 0.4 });
    this.mesh = new THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>(undefined, material);
    this.mesh.castShadow = true;
    this.mesh.visible = false;
    view.scene.add(this.mesh, this.fan.group);
    const canvas = view.canvas;
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.aim(event));
    for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, (event) => this.release(event));
    canvas.addEventListener("pointerleave", () => {
      if (!this.pushes) this.isOver = false;
    });
  }

  get tool(): Tool {
    return this.chosen;
  }
  set tool(tool: Tool) {
    if (tool === this.chosen) return;
    this.chosen = tool;
    this.placed = this.isOver = this.pushes = false;
    this.mesh.visible = this.fan.group.visible = false;
    this.mesh.geometry.dispose();
    this.mesh.geometry = tool === "box" ? new THREE.BoxGeometry(2, 2, 2) : new THREE.SphereGeometry(1, 48, 32);
  }

  // Moves the collider or the fan and sends it, or its removal. Call once per drawn frame.
  send(input: Input, nowMs: number): void {
    const colliders = this.update(nowMs);
    if (colliders.length > 0 || this.sent) input.setColliders(colliders);
    this.sent = colliders.length > 0;
    const winds = this.blow();
    if (winds.length > 0 || this.blows) input.setWinds(winds);
    this.blows = winds.length > 0;
  }

  // The fan as it is now; none while the pointer is elsewhere.
  private blow(): readonly OwnWind[] {
    this.fan.group.visible = this.isOver && this.chosen === "fan";
    if (!this.fan.group.visible) return kNoWinds;
    this.findGoal();
    this.placed = true;
    const { direction } = this.raycaster.ray;
    const place = this.goal.clone().addScaledVector(direction, -kFanDistance);
    this.fan.place(place, direction);
    return [heldFan(place, direction, 1, this.pushes ? kStrong : 1)];
  }

  // The collider as it is now; none while the pointer is elsewhere.
  private update(nowMs: number): readonly OwnCollider[] {
    this.mesh.visible = this.isOver && (this.chosen === "ball" || this.chosen === "box");
    if (!this.mesh.visible) {
      if (!this.isOver) this.placed = false;
      return kNoColliders;
    }
    const seconds = this.placed ? Math.min(kLongestStep, (nowMs - this.drawnAt) / 1000) : 0;
    this.drawnAt = nowMs;
    this.findGoal();
    const { position } = this.mesh;
    if (!this.placed) position.copy(this.goal).addScaledVector(this.raycaster.ray.direction, -2 * this.radius);
    this.placed = true;
    const way = this.goal.clone().sub(position);
    position.add(way.clampLength(0, kSpeed * seconds));
    this.mesh.scale.setScalar(this.radius);
    const at = position.toArray();
    if (this.chosen === "ball") return [{ shape: Shape.sphere, position: at, radius: this.radius }];
    this.mesh.quaternion.copy(this.view.camera.quaternion);
    const { x, y, z, w } = this.mesh.quaternion;
    const edge = 2 * this.radius;
    return [{ shape: Shape.box, position: at, orientation: [x, y, z, w], size: [edge, edge, edge] }];
  }

  // Before the cloth under the pointer, or in the plane through the middle of the scene. A press pushes behind it.
  private findGoal(): void {
    this.raycaster.setFromCamera(this.pointer, this.view.camera);
    const { origin, direction } = this.raycaster.ray;
    const cloth = this.pushes ? undefined : this.castRay([origin.x, origin.y, origin.z], [direction.x, direction.y, direction.z]);
    const facing = this.view.camera.getWorldDirection(new THREE.Vector3());
    if (cloth) this.plane.setFromNormalAndCoplanarPoint(facing, new THREE.Vector3(...cloth.position));
    else if (!this.placed) this.plane.setFromNormalAndCoplanarPoint(facing, this.view.box.getCenter(new THREE.Vector3()));
    if (!this.raycaster.ray.intersectPlane(this.plane, this.goal)) return;
    this.goal.addScaledVector(direction, this.pushes ? (kPush - 1) * this.radius : -1.05 * this.radius);
  }

  private press(event: PointerEvent): void {
    if (this.chosen === "hand" || event.button !== 0 || this.view.fingers.areTwo) return;
    // The view does not turn, and nothing is dragged.
    event.stopImmediatePropagation();
    this.view.canvas.setPointerCapture(event.pointerId);
    this.aim(event);
    if (!this.placed) this.update(performance.now());
    this.pushes = true;
  }

  private release(event: PointerEvent): void {
    this.pushes = false;
    if (event.pointerType !== "mouse") this.isOver = false;
  }

  private aim(event: PointerEvent): void {
    if (this.chosen === "hand" || this.view.fingers.areTwo) return;
    const frame = this.view.canvas.getBoundingClientRect();
    this.pointer.set(
      (2 * (event.clientX - frame.left)) / frame.width - 1,
      1 - (2 * (event.clientY - frame.top)) / frame.height,
    );
    this.isOver = true;
  }
}
