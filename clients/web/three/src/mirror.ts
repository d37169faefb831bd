// SPDX-License-Identifier: MIT
// A mirror that stands in the scene, for a user who wears a body.

import * as THREE from "three";
import { Reflector } from "three/examples/jsm/objects/Reflector.js";

const kWidth = 1; // m
const kHeight = 2;
const kBefore = 1.6; // m, from the user
const kPixels = 768; // of its height

export class Mirror {
  readonly group = new THREE.Group();
  private readonly glass: Reflector;

  // `reflecting(true)` is called before the scene is drawn as the mirror shows it, and `reflecting(false)` afterwards.
  constructor(reflecting: (on: boolean) => void) {
    this.glass = new Reflector(new THREE.PlaneGeometry(kWidth, kHeight), {
      textureWidth: (kPixels * kWidth) / kHeight,
      textureHeight: kPixels,
      color: 0x8c9092,
      multisample: 2,
    });
    const { glass } = this;
    const draw = glass.onBeforeRender.bind(glass);
    glass.onBeforeRender = (...of) => {
      reflecting(true);
      draw(...of);
      reflecting(false);
    };
    const frame = new THREE.Mesh(
      new THREE.BoxGeometry(kWidth + 0.08, kHeight + 0.08, 0.03),
      new THREE.MeshStandardMaterial({ color: 0x2e2a26, roughness: 0.5 }),
    );
    frame.position.set(0, kHeight / 2 + 0.04, -0.02);
    glass.position.set(0, kHeight / 2 + 0.04, 0);
    this.group.add(frame, glass);
    this.group.visible = false;
  }

  // Puts it before a person on the floor, facing it. `look` is a horizontal direction.
  stand(person: THREE.Vector3, look: THREE.Vector3): void {
    this.group.position.copy(person).addScaledVector(look, kBefore);
    this.group.rotation.y = Math.atan2(-look.x, -look.z);
    this.group.visible = true;
  }

  hide(): void {
    this.group.visible = false;
  }

  get isShown(): boolean {
    return this.group.visible;
  }
}
