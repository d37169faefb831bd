// SPDX-License-Identifier: MIT
// Surroundings of the cloths: lights, shadow, floor and background, fitted to the size of the scene.

import * as THREE from "three";
import { aimSoftLight } from "./soft_shadow";

const kBackground = 0x1b1c20;
const kKeyDirection = new THREE.Vector3(0.8, 1.0, 0.65);

export class Studio {
  readonly scene = new THREE.Scene();
  private readonly key = new THREE.DirectionalLight(0xfff1df, 3.0);
  private readonly rim = new THREE.DirectionalLight(0xb4c4de, 0.7);
  private readonly floor: THREE.Mesh<THREE.CircleGeometry, THREE.MeshStandardMaterial>;
  private readonly fog = new THREE.Fog(kBackground);

  constructor() {
    this.scene.background = new THREE.Color(kBackground);
    this.scene.fog = this.fog;
    this.scene.add(new THREE.HemisphereLight(0xe9ecf2, 0xa39a93, 2.3));

    this.scene.add(this.key, this.key.target, this.rim, this.rim.target);

    const material = new THREE.MeshStandardMaterial({ color: 0x27282b, roughness: 0.95 });
    this.floor = new THREE.Mesh(new THREE.CircleGeometry(1, 96), material);
    this.floor.rotation.x = -Math.PI / 2;
    this.floor.receiveShadow = true;
    this.scene.add(this.floor);
  }

  // Unit vector from the scene to the key light.
  get lightDirection(): THREE.Vector3 {
    return this.key.position.clone().sub(this.key.target.position).normalize();
  }

  // Hides floor, fog and background, so that the real room is seen.
  passThrough(on: boolean): void {
    this.floor.visible = !on;
    this.scene.background = on ? null : new THREE.Color(kBackground);
    this.scene.fog = on ? null : this.fog;
  }

  fit(bounds: THREE.Box3, floorHeight: number): void {
    const centre = bounds.getCenter(new THREE.Vector3());
    const radius = bounds.getBoundingSphere(new THREE.Sphere()).radius;

    this.floor.position.y = floorHeight;
    this.floor.scale.setScalar(20 * radius);
    this.fog.near = 3.5 * radius;
    this.fog.far = 17 * radius;

    aimSoftLight(this.key, new THREE.Sphere(centre, radius), kKeyDirection);
    this.rim.target.position.copy(centre);
    this.rim.position.set(-0.8, 0.5, -0.7).normalize().multiplyScalar(4 * radius).add(centre);
  }
}
