// SPDX-License-Identifier: MIT
// Draws the user's own hands and controllers. In pass-through they only hide what is behind them.

import * as THREE from "three";
import { FanFigure } from "../fan";
import type { Body } from "./body";
import type { Limb } from "./limb";
import { kJoints, type TrackedHand } from "./tracked_hand";

const kControllerRadius = 0.045; // m
const kRayLength = 3; // m

// Joints at both ends of each bone that is drawn, in the order of XRHand.
const kBones = [
  [0, 1], [1, 2], [2, 3], [3, 4],
  [0, 5], [5, 6], [6, 7], [7, 8], [8, 9],
  [0, 10], [10, 11], [11, 12], [12, 13], [13, 14],
  [0, 15], [15, 16], [16, 17], [17, 18], [18, 19],
  [0, 20], [20, 21], [21, 22], [22, 23], [23, 24],
] as const;

const kUp = new THREE.Vector3(0, 1, 0);

// A hand: a sphere per joint and a cylinder per bone.
class HandFigure {
  readonly group = new THREE.Group();
  private readonly joints: THREE.InstancedMesh;
  private readonly bones: THREE.InstancedMesh;
  private readonly matrix = new THREE.Matrix4();
  private readonly from = new THREE.Vector3();
  private readonly to = new THREE.Vector3();
  private readonly turn = new THREE.Quaternion();
  private readonly size = new THREE.Vector3();

  constructor(material: THREE.Material) {
    this.joints = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 12, 8), material, kJoints);
    this.bones = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 10, 1, true), material, kBones.length);
    for (const mesh of [this.joints, this.bones]) {
      mesh.frustumCulled = false;
      this.group.add(mesh);
    }
  }

  place(hand: TrackedHand): void {
    const { joints } = hand;
    this.turn.identity();
    for (let i = 0; i < kJoints; ++i) {
      this.matrix.compose(hand.joint(i, this.from), this.turn, this.size.setScalar(joints[4 * i + 3]!));
      this.joints.setMatrixAt(i, this.matrix);
    }
    for (let bone = 0; bone < kBones.length; ++bone) {
      const a = kBones[bone]![0];
      const b = kBones[bone]![1];
      hand.joint(a, this.from);
      hand.joint(b, this.to);
      const radius = Math.min(joints[4 * a + 3]!, joints[4 * b + 3]!);
      const length = this.to.distanceTo(this.from);
      this.turn.setFromUnitVectors(kUp, this.size.subVectors(this.to, this.from).divideScalar(Math.max(length, 1e-6)));
      this.matrix.compose(this.from.lerp(this.to, 0.5), this.turn, this.size.set(radius, length, radius));
      this.bones.setMatrixAt(bone, this.matrix);
    }
    this.joints.instanceMatrix.needsUpdate = this.bones.instanceMatrix.needsUpdate = true;
  }

  dispose(): void {
    this.joints.dispose();
    this.bones.dispose();
    this.joints.geometry.dispose();
    this.bones.geometry.dispose();
  }
}

// A controller: the sphere with which it pushes.
class ControllerFigure {
  readonly group: THREE.Mesh;

  constructor(material: THREE.Material) {
    this.group = new THREE.Mesh(new THREE.SphereGeometry(kControllerRadius, 24, 16), material);
  }
  dispose(): void {
    this.group.geometry.dispose();
  }
}

export class Figures {
  readonly group = new THREE.Group();
  private readonly material = new THREE.MeshStandardMaterial({ color: 0xd8b49c, roughness: 0.7 });
  private readonly rayMaterial = new THREE.LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.5 });
  private readonly drawn = new Map<Limb, HandFigure | ControllerFigure>();
  private readonly rays = new Map<Limb, THREE.Line>();
  private readonly fan = new FanFigure();

  constructor() {
    this.group.add(this.fan.group);
  }

  // In pass-through, real hands are seen where nothing is drawn: the figures write only depth.
  set passThrough(on: boolean) {
    this.material.colorWrite = !on;
    this.group.renderOrder = on ? -1 : 0;
  }

  // `scale` is metres of the room per metre of the scene.
  place(body: Body, scale: number): void {
    for (const figure of this.drawn.values()) figure.group.visible = false;
    for (const ray of this.rays.values()) ray.visible = false;
    const holder = body.fanHolder?.pose;
    this.fan.group.visible = holder?.ray !== undefined;
    if (holder?.ray) this.fan.place(holder.point, holder.ray.direction, 1 / scale);
    for (const limb of body.present()) {
      if (limb.side === "none") continue;
      const figure = this.figureOf(limb);
      figure.group.visible = true;
      if (figure instanceof HandFigure) {
        figure.place(limb.hand);
      } else {
        figure.group.position.copy(limb.pose.point);
        figure.group.scale.setScalar(1 / scale);
        this.placeRay(limb, scale);
      }
    }
  }

  clear(): void {
    for (const figure of this.drawn.values()) {
      this.group.remove(figure.group);
      figure.dispose();
    }
    for (const ray of this.rays.values()) {
      this.group.remove(ray);
      ray.geometry.dispose();
    }
    this.drawn.clear();
    this.rays.clear();
  }

  private figureOf(limb: Limb): HandFigure | ControllerFigure {
    let figure = this.drawn.get(limb);
    if (!figure) {
      figure = limb.isHand ? new HandFigure(this.material) : new ControllerFigure(this.material);
      this.drawn.set(limb, figure);
      this.group.add(figure.group);
    }
    return figure;
  }

  private placeRay(limb: Limb, scale: number): void {
    if (!limb.pose.ray) return;
    let line = this.rays.get(limb);
    if (!line) {
      const geometry = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, -1)]);
      line = new THREE.Line(geometry, this.rayMaterial);
      this.rays.set(limb, line);
      this.group.add(line);
    }
    line.visible = true;
    line.position.copy(limb.pose.ray.origin);
    line.quaternion.setFromUnitVectors(kForward, limb.pose.ray.direction);
    line.scale.setScalar(kRayLength / scale);
  }
}

const kForward = new THREE.Vector3(0, 0, -1);
