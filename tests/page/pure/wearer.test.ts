// SPDX-License-Identifier: MIT
// Knowledge of a headset about its user, for the body that the user wears: body tracking, hands and controllers.

import * as THREE from "three";
import { assert, test } from "vitest";
import type { BodyPose, TrackedBody, Vec3, Wearing } from "@clothstream/client";
import { type Body, Limb, Wearer } from "@clothstream/three";

// A user whose head is at a height of 1.6 m and who has these limbs; WebXR body tracking knows joints at these places of
// the room. The scene is twice as large as the room, and 1 m above it. Returns what is sent.
function sent(limbs: Limb[], joints?: Record<string, Vec3>, headPresent = true): TrackedBody | undefined {
  let result: TrackedBody | undefined;
  const wearing = { isWearing: true, follow: (tracked: TrackedBody) => ((result = tracked), true) } as unknown as Wearing;
  const body = { head: new THREE.Vector3(0, 1.6, 0), headOrientation: new THREE.Quaternion(), headPresent, present: () => limbs } as unknown as Body;
  const frame = {
    body: joints && new Map(Object.keys(joints).map((name) => [name, name])),
    getPose: (joint: string) => ({ transform: { matrix: new THREE.Matrix4().setPosition(...joints![joint]!).elements } }),
  } as unknown as XRFrame;
  const toScene = new THREE.Matrix4().makeScale(2, 2, 2).setPosition(0, 1, 0);
  new Wearer().send(wearing, body, frame, {} as XRReferenceSpace, toScene, 0.5);
  return result;
}

function near(found: readonly number[] | undefined, wanted: readonly number[]): void {
  assert.equal(found?.length, wanted.length);
  for (const [axis, value] of wanted.entries()) assert.closeTo(found![axis]!, value, 1e-6);
}

function controller(side: XRHandedness, point: Vec3): Limb {
  const limb = new Limb(side, false);
  limb.pose.point.set(...point);
  return limb;
}

test("without a head nothing is sent, and a head alone stands on the floor", () => {
  assert.isUndefined(sent([], undefined, false));
  const head = sent([])!;
  assert.deepEqual(Object.keys(head), ["floor", "head"]);
  assert.equal(head.floor, 1);
  near(head.head.position, [0, 1.6, 0]);
});

// The arm leaves a grip towards -Y: 8 cm of the room are 16 cm of the scene.
test("a hand that holds a controller is where its wrist is", () => {
  const hands = sent([controller("left", [-1, 1, 0]), controller("right", [1, 1, 0])])!;
  near(hands.leftHand!.position, [-1, 0.84, 0]);
  near(hands.rightHand!.position, [1, 0.84, 0]);
  const axes = ({ orientation }: BodyPose) => {
    const turn = new THREE.Quaternion(...orientation);
    return { fingers: new THREE.Vector3(0, 0, -1).applyQuaternion(turn).toArray(), back: new THREE.Vector3(0, 1, 0).applyQuaternion(turn).toArray() };
  };
  near(axes(hands.leftHand!).fingers, [0, 1, 0]);
  near(axes(hands.leftHand!).back, [1, 0, 0]);
  near(axes(hands.rightHand!).fingers, [0, 1, 0]);
  near(axes(hands.rightHand!).back, [-1, 0, 0]);
});

test("a tracked hand has priority over the controller of its side", () => {
  const hand = new Limb("right", true);
  hand.hand.joints.set([3, 4, 5]);
  for (const limbs of [[hand, controller("right", [1, 1, 0])], [controller("right", [1, 1, 0]), hand]]) near(sent(limbs)!.rightHand!.position, [3, 4, 5]);
});

test("joints of body tracking are sent, and wrists of it where nothing else knows the hand", () => {
  const joints: Record<string, Vec3> = {
    hips: [0, 0.9, 0],
    "left-arm-lower": [-0.4, 1.1, 0],
    "right-arm-lower": [0.4, 1.1, 0],
    "left-foot-ankle": [-0.1, 0.1, 0],
    "right-foot-ankle": [0.1, 0.1, 0],
    "left-hand-wrist": [-0.5, 1, -0.2],
    "right-hand-wrist": [0.5, 1, -0.2],
  };
  const all = sent([controller("right", [1, 1, 0])], joints)!;
  near(all.hips, [0, 2.8, 0]);
  near(all.leftElbow, [-0.8, 3.2, 0]);
  near(all.rightElbow, [0.8, 3.2, 0]);
  near(all.leftAnkle, [-0.2, 1.2, 0]);
  near(all.rightAnkle, [0.2, 1.2, 0]);
  near(all.leftHand!.position, [-1, 3, -0.4]);
  near(all.rightHand!.position, [1, 0.84, 0]);
  delete joints["hips"];
  assert.isUndefined(sent([], joints)!.hips);
});
