// SPDX-License-Identifier: MIT
// Moves the body that the user of a headset wears: by body tracking where the browser has it, and else by the head and
// the hands or controllers.

import * as THREE from "three";
import type { BodyPose, TrackedBody, Vec3, Wearing } from "@clothstream/client";
import type { Body } from "./body";
import type { Limb } from "./limb";

// Way from the palm that holds a controller back to the wrist, m of the room.
const kPalmToWrist = 0.08;

// Joints of WebXR body tracking. Of an arm or leg, the joint is the end that is nearer to the body.
const kBodyJoints = {
  hips: "hips",
  leftElbow: "left-arm-lower",
  rightElbow: "right-arm-lower",
  leftAnkle: "left-foot-ankle",
  rightAnkle: "right-foot-ankle",
} as const;
const kWrists = { left: "left-hand-wrist", right: "right-hand-wrist" } as const;

// WebXR body tracking: spaces of the joints that the device tracks.
type BodyFrame = XRFrame & { readonly body?: ReadonlyMap<string, XRSpace> | null };

export class Wearer {
  private readonly matrix = new THREE.Matrix4();
  private readonly point = new THREE.Vector3();
  private readonly turn = new THREE.Quaternion();
  private readonly size = new THREE.Vector3();
  private readonly axes = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()] as const;

  // Sends the body. Call it once per frame, after the poses of `body` are read. `toScene` leads from the reference space,
  // whose floor is at 0, to the scene; `scale` is metres of the room per metre of the scene. Does nothing without a body
  // or a head.
  send(wearing: Wearing, body: Body, frame: XRFrame, space: XRReferenceSpace, toScene: THREE.Matrix4, scale: number): void {
    if (!wearing.isWearing || !body.headPresent) return;
    const tracked: TrackedBody = {
      floor: this.point.set(0, 0, 0).applyMatrix4(toScene).y,
      head: { position: body.head.toArray(), orientation: body.headOrientation.toArray() as [number, number, number, number] },
    };
    for (const limb of body.present()) {
      if (limb.side === "none") continue;
      const key = limb.side === "left" ? "leftHand" : "rightHand";
      // A tracked hand has priority over a controller that lies near.
      if (limb.isHand || !tracked[key]) tracked[key] = limb.isHand ? wristOf(limb) : this.controllerWrist(limb, scale);
    }
    this.addJoints(tracked, frame, space, toScene);
    wearing.follow(tracked);
  }

  private addJoints(tracked: TrackedBody, frame: BodyFrame, space: XRReferenceSpace, toScene: THREE.Matrix4): void {
    const { body } = frame;
    if (!body) return;
    const read = (name: string): boolean => {
      const joint = body.get(name);
      const pose = joint && frame.getPose(joint, space);
      if (!pose) return false;
      this.matrix.multiplyMatrices(toScene, this.matrix.fromArray(pose.transform.matrix));
      this.matrix.decompose(this.point, this.turn, this.size);
      return true;
    };
    for (const [part, name] of Object.entries(kBodyJoints) as [keyof typeof kBodyJoints, string][])
      if (read(name)) tracked[part] = this.point.toArray() as Vec3;
    // Hands that neither the device's hand tracking nor a controller shows.
    if (!tracked.leftHand && read(kWrists.left)) tracked.leftHand = this.pose();
    if (!tracked.rightHand && read(kWrists.right)) tracked.rightHand = this.pose();
  }

  private pose(): BodyPose {
    const { x, y, z, w } = this.turn;
    return { position: this.point.toArray(), orientation: [x, y, z, w] };
  }

  // The grip of WebXR: the handle is along Z with the thumb at -Z, and +X leaves the back of the left hand or the palm of
  // the right one. So the knuckles are towards +Y, seen from the wrist.
  private controllerWrist(limb: Limb, scale: number): BodyPose {
    const [across, back, towardsArm] = this.axes;
    const sign = limb.side === "left" ? 1 : -1;
    back.set(sign, 0, 0);
    towardsArm.set(0, -1, 0);
    across.crossVectors(back, towardsArm);
    this.turn.setFromRotationMatrix(this.matrix.makeBasis(across, back, towardsArm)).premultiply(limb.pose.orientation);
    this.point.copy(towardsArm.applyQuaternion(limb.pose.orientation)).multiplyScalar(kPalmToWrist / scale).add(limb.pose.point);
    return this.pose();
  }
}

function wristOf({ hand }: Limb): BodyPose {
  const { x, y, z, w } = hand.orientation;
  return { position: [hand.joints[0]!, hand.joints[1]!, hand.joints[2]!], orientation: [x, y, z, w] };
}
