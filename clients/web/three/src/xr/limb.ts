// SPDX-License-Identifier: MIT
// One input of a headset in scene coordinates: a tracked hand, a controller, or a ray of the gaze or a screen.

import * as THREE from "three";
import { Grabber, type GrabPose } from "./grabber";
import { kHoldMs, TrackedHand } from "./tracked_hand";

export class Limb {
  readonly hand = new TrackedHand();
  readonly grabber = new Grabber();
  readonly pose: GrabPose = { point: new THREE.Vector3(), orientation: new THREE.Quaternion(), ray: undefined };
  // Pressed: the hand pinches, or a button of the controller is down. `isNew` until the next frame.
  pressed = false;
  isNew = false;
  present = false;
  // Whether the device showed it in the newest frame. `present` lasts a moment longer.
  seen = false;
  private readonly ray = new THREE.Ray();
  private readonly matrix = new THREE.Matrix4();
  private readonly unused = new THREE.Vector3();
  private seenAt = -Infinity;

  constructor(
    readonly side: XRHandedness,
    readonly isHand: boolean,
  ) {}

  // Call once per frame. `source` is undefined while the device does not have this input.
  update(frame: XRFrame, space: XRReferenceSpace, source: XRInputSource | undefined, toScene: THREE.Matrix4, nowMs: number): void {
    this.aim(source && frame.getPose(source.targetRaySpace, space), toScene);
    if (this.isHand) {
      this.hand.update(frame, space, source?.hand, toScene, nowMs);
      this.present = this.hand.present;
      this.seen = this.hand.seen;
      if (!this.present) return this.lose();
      this.hand.pinchPoint(this.pose.point);
      this.pose.orientation.copy(this.hand.orientation);
      return;
    }
    const grip = source && frame.getPose(source.gripSpace ?? source.targetRaySpace, space);
    this.seen = Boolean(grip);
    if (grip) {
      this.seenAt = nowMs;
      this.matrix.multiplyMatrices(toScene, this.matrix.fromArray(grip.transform.matrix));
      this.matrix.decompose(this.pose.point, this.pose.orientation, this.unused);
    }
    this.present = nowMs - this.seenAt <= kHoldMs;
    if (!this.present) this.lose();
  }

  press(): void {
    this.pressed = this.isNew = true;
  }
  release(): void {
    this.pressed = this.isNew = false;
    this.grabber.release();
  }

  // A hand that is gone holds nothing.
  private lose(): void {
    if (this.pressed) this.release();
  }

  private aim(pose: XRPose | undefined, toScene: THREE.Matrix4): void {
    this.pose.ray = pose ? this.ray : undefined;
    if (!pose) return;
    this.matrix.multiplyMatrices(toScene, this.matrix.fromArray(pose.transform.matrix));
    this.ray.origin.setFromMatrixPosition(this.matrix);
    this.ray.direction.set(0, 0, -1).transformDirection(this.matrix);
  }
}
