// SPDX-License-Identifier: MIT
// A fan that the user holds: the wind that it makes, and how it is drawn.

import * as THREE from "three";
import { WindKind, type OwnWind } from "@clothstream/client";

const kRadius = 0.15; // m, of the opening
const kLeastRadius = 0.05; // m; the server accepts no smaller one
const kSpeed = 8; // m/s
const kRange = 3; // m
const kBlades = 4;
const kTurns = 3; // of the blades, 1/s
const kUp = new THREE.Vector3(0, 1, 0);

// Wind of a fan at this place of the scene that blows in this direction, a unit vector. `size` is 1 for a scene in real size,
// and `strength` 1 for the usual speed.
export function heldFan(place: THREE.Vector3, direction: THREE.Vector3, size = 1, strength = 1): OwnWind {
  const { x, y, z, w } = new THREE.Quaternion().setFromUnitVectors(kUp, direction);
  const radius = Math.max(kLeastRadius, size * kRadius);
  return { kind: WindKind.fan, position: place.toArray(), orientation: [x, y, z, w], speed: strength * kSpeed, radius, reach: Math.max(radius, size * kRange) };
}

export class FanFigure {
  readonly group = new THREE.Group();
  private readonly blades = new THREE.Group();

  constructor() {
    const metal = new THREE.MeshStandardMaterial({ color: 0x9aa3ad, roughness: 0.35, metalness: 0.6 });
    const paint = new THREE.MeshStandardMaterial({ color: 0xe2a04a, roughness: 0.4, side: THREE.DoubleSide });
    // Everything turns about +Y, the direction of the wind.
    const cage = new THREE.Mesh(new THREE.TorusGeometry(kRadius, 0.008, 12, 48), metal);
    cage.rotation.x = Math.PI / 2;
    const hub = new THREE.Mesh(new THREE.CylinderGeometry(0.025, 0.03, 0.05, 24), metal);
    const handle = new THREE.Mesh(new THREE.CylinderGeometry(0.012, 0.016, 0.16, 16), metal);
    handle.position.y = -0.1;
    const shape = new THREE.PlaneGeometry(0.06, kRadius - 0.035);
    for (let i = 0; i < kBlades; ++i) {
      const blade = new THREE.Mesh(shape, paint);
      // Pitched, along the radius.
      blade.position.y = (kRadius + 0.015) / 2;
      blade.rotation.y = 0.5;
      const arm = new THREE.Group();
      arm.add(blade);
      arm.rotation.z = (2 * Math.PI * i) / kBlades;
      this.blades.add(arm);
    }
    const facing = new THREE.Group();
    facing.rotation.x = Math.PI / 2;
    facing.add(this.blades);
    this.group.add(cage, hub, handle, facing);
    this.group.visible = false;
  }

  // Puts the fan where heldFan() has it, with its blades as they are now.
  place(place: THREE.Vector3, direction: THREE.Vector3, size = 1): void {
    this.group.position.copy(place);
    this.group.quaternion.setFromUnitVectors(kUp, direction);
    this.group.scale.setScalar(Math.max(kLeastRadius / kRadius, size));
    this.blades.rotation.z = ((performance.now() / 1000) % 1) * kTurns * 2 * Math.PI;
  }
}
