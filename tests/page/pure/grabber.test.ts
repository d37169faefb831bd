// SPDX-License-Identifier: MIT
// Taking hold of the cloth with a hand or along a ray, and the frame rate of a headset.

import * as THREE from "three";
import { assert, test } from "vitest";
import type { ClothPoint, Vec3 } from "@clothstream/client";
import { chooseRate, Grabber, newGrabId, type GrabPose, type Touchable } from "@clothstream/three";

// Cloth with one point, which every ray meets.
function clothAt(position: Vec3): Touchable {
  const found = (distance: number): ClothPoint => ({ position, distance, place: Uint8Array.of(7) });
  const distanceFrom = (point: Vec3) => Math.hypot(...position.map((value, axis) => value - point[axis]!));
  return {
    nearestPoint: (point, maxDistance) => (distanceFrom(point) <= maxDistance ? found(distanceFrom(point)) : undefined),
    castRay: (origin) => found(distanceFrom(origin)),
  };
}

function handAt(x: number, y: number, z: number, ray?: THREE.Ray): GrabPose {
  return { point: new THREE.Vector3(x, y, z), orientation: new THREE.Quaternion(), ray };
}

test("a held place keeps its offset from the hand, and turns with it", () => {
  const grabber = new Grabber();
  assert.isTrue(grabber.take(handAt(1, 1, 0), clothAt([1.05, 1, 0]), 0.1));
  const turned = handAt(2, 1, 0);
  turned.orientation.setFromAxisAngle(new THREE.Vector3(0, 0, 1), Math.PI / 2);
  const grab = grabber.grab(turned)!;
  for (const [axis, value] of [2, 1.05, 0].entries()) assert.closeTo(grab.position[axis]!, value, 1e-9);
  for (const [axis, value] of [0, 0, Math.SQRT1_2, Math.SQRT1_2].entries()) assert.closeTo(grab.orientation![axis]!, value, 1e-9);
  assert.deepEqual(grab.place, Uint8Array.of(7));
});

test("cloth out of reach is held along the ray, at its distance", () => {
  const grabber = new Grabber();
  const ray = new THREE.Ray(new THREE.Vector3(), new THREE.Vector3(0, 0, -1));
  assert.isFalse(grabber.take(handAt(0, 0, 0), clothAt([0, 0, -2]), 0.1));
  assert.isTrue(grabber.take(handAt(0, 0, 0, ray), clothAt([0, 0, -2]), 0.1));
  ray.direction.set(1, 0, 0);
  const grab = grabber.grab(handAt(0, 0, 0, ray))!;
  assert.deepEqual(grab.position, [2, 0, 0]);
  assert.isUndefined(grab.orientation);
});

test("each grab has a new id, and only its own id ends it", () => {
  const grabber = new Grabber();
  const take = () => grabber.take(handAt(0, 0, 0), clothAt([0, 0, 0]), 0.1);
  take();
  const { id } = grabber.grab(handAt(0, 0, 0))!;
  assert.isAbove(newGrabId(), id);
  grabber.slipped(id + 1);
  assert.isTrue(grabber.holds);
  grabber.slipped(id);
  assert.isFalse(grabber.holds);
  assert.isUndefined(grabber.grab(handAt(0, 0, 0)));
  take();
  assert.isAbove(grabber.grab(handAt(0, 0, 0))!.id, id + 1);
});

test("the lowest frame rate that shows every frame of the stream is chosen", () => {
  const offered = Float32Array.of(120, 72, 90);
  assert.equal(chooseRate(offered, 72), 72);
  assert.equal(chooseRate(offered, 72.3), 72);
  assert.equal(chooseRate(offered, 80), 90);
  assert.equal(chooseRate(offered, 144), 120);
  assert.isUndefined(chooseRate(undefined, 72));
  assert.isUndefined(chooseRate(new Float32Array(), 72));
});
