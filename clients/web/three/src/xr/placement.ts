// SPDX-License-Identifier: MIT
// Where the scene of the server stands in the user's room: position of its origin, turn around the vertical, and scale.

import * as THREE from "three";

const kLeastScale = 0.05;
const kMostScale = 20;
const kUp = new THREE.Vector3(0, 1, 0);

export class Placement {
  // From scene to room.
  readonly matrix = new THREE.Matrix4();
  readonly inverse = new THREE.Matrix4();
  private readonly origin = new THREE.Vector3();
  private readonly turned = new THREE.Quaternion();
  private yaw = 0;
  private size = 1;

  get position(): THREE.Vector3 {
    return this.origin.clone();
  }
  get turn(): number {
    return this.yaw;
  }
  get scale(): number {
    return this.size;
  }

  // `turn` in radians, counter-clockwise seen from above. The scale is limited to 0.05 to 20.
  set(position: THREE.Vector3, turn: number, scale: number): void {
    this.origin.copy(position);
    this.yaw = turn;
    this.size = THREE.MathUtils.clamp(scale, kLeastScale, kMostScale);
    this.turned.setFromAxisAngle(kUp, turn);
    this.matrix.compose(this.origin, this.turned, new THREE.Vector3().setScalar(this.size));
    this.inverse.copy(this.matrix).invert();
  }

  // Moves the scene so that `point` (scene coordinates) lies at `at` (room coordinates), with its turn and scale.
  moveTo(point: THREE.Vector3, at: THREE.Vector3): void {
    const offset = point.clone().multiplyScalar(this.size).applyQuaternion(this.turned);
    this.set(at.clone().sub(offset), this.yaw, this.size);
  }

  // Placement that all headsets of one physical room find by touching the same two points in the same order: the origin
  // of the scene lies at the first one, and its x axis points towards the second one. Returns false, and changes
  // nothing, if the points are less than 0.2 m apart from each other, seen from above.
  setByTwoPoints(first: THREE.Vector3, second: THREE.Vector3): boolean {
    const x = second.x - first.x;
    const z = second.z - first.z;
    if (!(Math.hypot(x, z) >= kLeastDistance)) return false;
    this.set(first, Math.atan2(-z, x), 1);
    return true;
  }
}

// Touched points that are close together give an uncertain direction: 5 mm at 0.2 m turn the scene by 1.4 degrees.
const kLeastDistance = 0.2;

// Moves, turns and scales a placement with two hands: points of the scene under the hands stay under them.
export class TwoHandMove {
  private readonly start = { middle: new THREE.Vector3(), turn: 0, scale: 1, angle: 0, distance: 1 };
  private readonly held = new THREE.Vector3(); // middle of the hands at the start, scene coordinates

  constructor(
    private readonly placement: Placement,
    left: THREE.Vector3,
    right: THREE.Vector3,
  ) {
    const { start } = this;
    start.middle.addVectors(left, right).multiplyScalar(0.5);
    start.turn = placement.turn;
    start.scale = placement.scale;
    start.angle = angleOf(left, right);
    start.distance = left.distanceTo(right);
    this.held.copy(start.middle).applyMatrix4(placement.inverse);
  }

  update(left: THREE.Vector3, right: THREE.Vector3): void {
    const { start, placement } = this;
    const middle = new THREE.Vector3().addVectors(left, right).multiplyScalar(0.5);
    const scale = start.distance > 0 ? (start.scale * left.distanceTo(right)) / start.distance : start.scale;
    placement.set(middle, start.turn + angleOf(left, right) - start.angle, scale);
    placement.moveTo(this.held, middle);
  }
}

// Angle of the line between two points, counter-clockwise seen from above.
function angleOf(from: THREE.Vector3, to: THREE.Vector3): number {
  return Math.atan2(from.z - to.z, to.x - from.x);
}
