// SPDX-License-Identifier: MIT
// Where the scene stands in the room: placing by two points, and moving it with two hands.

import * as THREE from "three";
import { assert, test } from "vitest";
import { Placement, TwoHandMove } from "@clothstream/three";

const at = (x: number, y: number, z: number) => new THREE.Vector3(x, y, z);

function near(actual: THREE.Vector3, expected: THREE.Vector3): void {
  assert.isBelow(actual.distanceTo(expected), 1e-9, `${actual.toArray().join(" ")} is not ${expected.toArray().join(" ")}`);
}

test("matrix and inverse lead to the room and back", () => {
  const placement = new Placement();
  placement.set(at(1, 2, 3), Math.PI / 2, 2);
  near(at(1, 0, 0).applyMatrix4(placement.matrix), at(1, 2, 1)); // x turns to -z, counter-clockwise seen from above
  near(at(0.3, -0.4, 0.5).applyMatrix4(placement.matrix).applyMatrix4(placement.inverse), at(0.3, -0.4, 0.5));
});

test("the scale stays between 0.05 and 20", () => {
  const placement = new Placement();
  for (const [wanted, expected] of [[0, 0.05], [1e9, 20], [3, 3]] as const) {
    placement.set(at(0, 0, 0), 0, wanted);
    assert.equal(placement.scale, expected);
  }
});

test("a point of the scene moves to a point of the room, with turn and scale", () => {
  const placement = new Placement();
  placement.set(at(5, 5, 5), 0.7, 1.5);
  placement.moveTo(at(1, 2, 3), at(-1, 0, 4));
  near(at(1, 2, 3).applyMatrix4(placement.matrix), at(-1, 0, 4));
  assert.equal(placement.turn, 0.7);
  assert.equal(placement.scale, 1.5);
});

test("two headsets with different origins that touch the same points agree", () => {
  const [first, second, mark] = [at(0.4, 0.8, -0.2), at(1.1, 0.9, 0.5), at(0.2, 1.5, 0.3)];
  // From the coordinates of one headset to those of the other: turned about the vertical, and moved.
  const other = new THREE.Matrix4().makeRotationY(1.9).setPosition(3, 0.1, -2);
  const placements = [new Placement(), new Placement()] as const;
  assert.isTrue(placements[0].setByTwoPoints(first, second));
  assert.isTrue(placements[1].setByTwoPoints(first.clone().applyMatrix4(other), second.clone().applyMatrix4(other)));
  const seen = mark.clone().applyMatrix4(placements[0].matrix).applyMatrix4(other);
  near(mark.clone().applyMatrix4(placements[1].matrix), seen);
  // The origin lies at the first point, and the x axis leads over or under the second one.
  near(at(0, 0, 0).applyMatrix4(placements[0].matrix), first);
  const along = at(1, 0, 0).applyMatrix4(placements[0].matrix).sub(first).normalize();
  near(along, at(0.7, 0, 0.7).normalize());
});

test("points that are too close together, or not numbers, change nothing", () => {
  const placement = new Placement();
  placement.set(at(1, 2, 3), 0.5, 2);
  const before = placement.matrix.clone();
  for (const second of [at(0.19, 0, 0), at(0, 5, 0), at(NaN, 0, 0)]) assert.isFalse(placement.setByTwoPoints(at(0, 0, 0), second));
  assert.isTrue(placement.matrix.equals(before));
});

test("the places under two hands stay under them", () => {
  const placement = new Placement();
  placement.set(at(1, 0, -2), 0.3, 0.8);
  const [left, right] = [at(-0.2, 1, -0.5), at(0.3, 1, -0.6)];
  const held = [left, right].map((hand) => hand.clone().applyMatrix4(placement.inverse));
  const move = new TwoHandMove(placement, left, right);
  // The hands turn by 0.6 about the vertical, go twice as far apart, and go elsewhere.
  const turned = (hand: THREE.Vector3) => hand.clone().applyAxisAngle(at(0, 1, 0), 0.6).multiplyScalar(2).add(at(0.5, -0.9, 0.1));
  move.update(turned(left), turned(right));
  near(held[0]!.applyMatrix4(placement.matrix), turned(left));
  near(held[1]!.applyMatrix4(placement.matrix), turned(right));
  assert.closeTo(placement.turn, 0.9, 1e-12);
  assert.closeTo(placement.scale, 1.6, 1e-12);
});

test("hands at one place do not scale the scene, and hands above each other do not turn it", () => {
  const placement = new Placement();
  placement.set(at(0, 0, 0), 0.3, 0.8);
  new TwoHandMove(placement, at(0, 1, 0), at(0, 1, 0)).update(at(0, 1, 0), at(1, 1, 0));
  assert.equal(placement.scale, 0.8);
  placement.set(at(0, 0, 0), 0.3, 0.8);
  new TwoHandMove(placement, at(0, 1, 0), at(0, 2, 0)).update(at(0, 1, 0), at(0, 3, 0));
  assert.closeTo(placement.turn, 0.3, 1e-12);
  assert.isTrue(placement.matrix.elements.every(Number.isFinite));
});
