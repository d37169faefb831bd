// SPDX-License-Identifier: MIT
// Joints of one tracked hand (XRHand) in scene coordinates. A hand that is lost keeps its last pose for a while.

import * as THREE from "three";

export const kJoints = 25;
export const kThumbTip = 4;
export const kIndexTip = 9;
// Time for which something that is lost keeps its last pose.
export const kHoldMs = 300;
const kLargestRadius = 0.1; // m

export class TrackedHand {
  // x, y, z and radius of each joint in the order of XRHand, metres of the scene.
  readonly joints = new Float32Array(4 * kJoints);
  // Orientation of the wrist in the scene.
  readonly orientation = new THREE.Quaternion();
  private readonly poses = new Float32Array(16 * kJoints);
  private readonly radii = new Float32Array(kJoints);
  private readonly point = new THREE.Vector3();
  private readonly turn = new THREE.Matrix4();
  private seenAt = -Infinity; // ms

  // Whether the joints hold, or did a moment ago.
  present = false;
  // Whether the device showed the hand in the newest frame.
  seen = false;

  // Call once per frame; `hand` is undefined while the device does not track it. `toScene` leads from the reference
  // space to the scene.
  update(frame: XRFrame, space: XRReferenceSpace, hand: XRHand | undefined, toScene: THREE.Matrix4, nowMs: number): void {
    this.seen = hand !== undefined && this.read(frame, space, hand, toScene);
    if (this.seen) this.seenAt = nowMs;
    this.present = nowMs - this.seenAt <= kHoldMs;
  }

  forget(): void {
    this.seenAt = -Infinity;
    this.present = this.seen = false;
  }

  // Copies a joint's position to `out`.
  joint(index: number, out: THREE.Vector3): THREE.Vector3 {
    return out.fromArray(this.joints, 4 * index);
  }

  // Point between thumb and index finger, where a pinch takes hold.
  pinchPoint(out: THREE.Vector3): THREE.Vector3 {
    return this.joint(kThumbTip, out).lerp(this.joint(kIndexTip, this.point), 0.5);
  }

  // Returns false, and keeps the old joints, if a joint is missing or not finite.
  private read(frame: XRFrame, space: XRReferenceSpace, hand: XRHand, toScene: THREE.Matrix4): boolean {
    if (!frame.fillPoses || !frame.fillJointRadii) return false;
    if (!frame.fillPoses(hand.values(), space, this.poses) || !frame.fillJointRadii(hand.values(), this.radii)) return false;
    if (!this.isPossible()) return false;
    this.turn.extractRotation(this.turn.multiplyMatrices(toScene, this.turn.fromArray(this.poses)));
    this.orientation.setFromRotationMatrix(this.turn);
    const scale = toScene.getMaxScaleOnAxis();
    for (let joint = 0; joint < kJoints; ++joint) {
      this.point.fromArray(this.poses, 16 * joint + 12).applyMatrix4(toScene).toArray(this.joints, 4 * joint);
      this.joints[4 * joint + 3] = this.radii[joint]! * scale;
    }
    return true;
  }

  // Called for each frame, so it makes no calls for each number.
  private isPossible(): boolean {
    for (let i = 0; i < this.poses.length; ++i) if (!Number.isFinite(this.poses[i]!)) return false;
    for (let i = 0; i < kJoints; ++i) if (!(this.radii[i]! > 0 && this.radii[i]! < kLargestRadius)) return false;
    return true;
  }
}
