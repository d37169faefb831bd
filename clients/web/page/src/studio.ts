// SPDX-License-Identifier: MIT
// Surroundings of the cloths: room, lights, shadow and background, fitted to the scene and to the preferred colour scheme.

import * as THREE from "three";
import type { Detail } from "@clothstream/three";
import { Room, type RoomColours } from "./room";
import { Sky, type SkyColours } from "./sky";
import { aimSoftLight, setCheapShadows, sizeSoftShadow } from "./soft_shadow";

const kKeyDirection = new THREE.Vector3(0.8, 1.0, 0.65).normalize();
const kRimDirection = new THREE.Vector3(-0.8, 0.5, -0.7).normalize();
// Scales that differ by less are the same: a matrix gives them with the error of its floats.
const kSameScale = 1e-4;

interface Scheme {
  key: number;
  keyStrength: number;
  rim: number;
  rimStrength: number;
  room: RoomColours;
  sky: SkyColours;
}

const kDay: Scheme = {
  key: 0xfff3e2,
  keyStrength: 4.6,
  rim: 0xcfe0f5,
  rimStrength: 0.7,
  room: {
    wall: 0xf6ecda,
    ceiling: 0xfaf3e6,
    trim: 0xfffaf0,
    floor: 0xffffff,
    sky: 0xbcd8f3,
    skyBelow: 0xf4f6f4,
    lamp: 0xfffaf0,
    outside: 0xcfc9be,
  },
  sky: { above: 0x8e9196, level: 0x787570, below: 0x66553f, key: 0xfff3e2, keyStrength: 3, rim: 0xcfe2fa, rimStrength: 2 },
};

const kEvening: Scheme = {
  key: 0xffe2bd,
  keyStrength: 3.3,
  rim: 0x8fb0e8,
  rimStrength: 1,
  room: {
    wall: 0x35373f,
    ceiling: 0x2a2c32,
    trim: 0x4a4c54,
    floor: 0x6e6259,
    sky: 0x20324f,
    skyBelow: 0x6b7f9e,
    lamp: 0xffe9c8,
    outside: 0x17181c,
  },
  sky: { above: 0x787880, level: 0x70737e, below: 0x5a5046, key: 0xffe2bd, keyStrength: 3, rim: 0x8fb0e8, rimStrength: 1.6 },
};

export class Studio {
  readonly scene = new THREE.Scene();
  private readonly room = new Room();
  private readonly key = new THREE.DirectionalLight();
  private readonly rim = new THREE.DirectionalLight();
  private readonly ambient = new THREE.LightProbe();
  private readonly fog = new THREE.Fog(0);
  private readonly background = new THREE.Color();
  // Shows the shadow of the cloths on the real floor while the room is hidden.
  private readonly catcher = new THREE.Mesh(new THREE.CircleGeometry(1, 48), new THREE.ShadowMaterial({ opacity: 0.4 }));
  private readonly dark = window.matchMedia("(prefers-color-scheme: dark)");
  private readonly bounds = new THREE.Box3();
  private readonly sphere = new THREE.Sphere();
  private floorHeight = 0;
  private diagonal = 0; // of the drawn room
  private roomScale = 1;
  private reflected: THREE.WebGLRenderTarget | undefined;
  private sky: Sky | undefined; // whose reflections are not made yet

  constructor(
    private readonly renderer: THREE.WebGLRenderer,
    private readonly detail: Detail,
    private readonly reflectionsChanged: (reflections: THREE.Texture) => void,
  ) {
    this.catcher.rotation.x = -Math.PI / 2;
    this.catcher.receiveShadow = true;
    this.scene.add(this.key, this.key.target, this.rim, this.rim.target, this.ambient, this.room.group, this.catcher);
    this.passThrough(false);
    this.light();
    this.dark.addEventListener("change", () => {
      this.light();
      this.fit(this.bounds, this.floorHeight);
    });
  }

  // Hides room, background and fog, so that the real room is seen. Shadows still fall on the floor of the scene, unless the
  // real room has a floor that takes them.
  passThrough(on: boolean, hasFloor = false): void {
    this.room.group.visible = !on;
    this.catcher.visible = on && !hasFloor;
    this.scene.background = on ? null : this.background;
    this.scene.fog = on ? null : this.fog;
  }

  // Shadows that need fewer samples, for headsets and phones.
  set cheapShadows(cheap: boolean) {
    setCheapShadows(this.key, cheap);
  }

  // Makes what the first picture can do without: reflections.
  complete(): void {
    if (!this.sky) return;
    this.reflected?.dispose();
    this.reflected = this.sky.reflections(this.renderer);
    this.sky = undefined;
    this.reflectionsChanged(this.reflected.texture);
  }

  // Unit vector from the scene to the key light.
  get lightDirection(): THREE.Vector3 {
    return kKeyDirection.clone();
  }

  // Half the width of the shadow map, m of the user's room.
  get shadowReach(): number {
    return this.key.shadow.camera.right;
  }

  fit(bounds: THREE.Box3, floorHeight: number): void {
    this.bounds.copy(bounds);
    this.floorHeight = floorHeight;
    const sphere = bounds.getBoundingSphere(this.sphere);
    this.diagonal = this.room.fit(bounds, floorHeight, kKeyDirection, this.scheme.room);
    this.catcher.position.set(sphere.center.x, floorHeight, sphere.center.z);
    this.catcher.scale.setScalar(3 * sphere.radius);
    aimSoftLight(this.key, sphere, kKeyDirection);
    this.rim.target.position.copy(sphere.center);
    this.rim.position.copy(kRimDirection).multiplyScalar(4 * sphere.radius).add(sphere.center);
    this.measure();
  }

  // Metres of the user's room per metre of the scene. Places of lights and meshes scale with the scene by themselves; fog
  // and shadow map are measured in the user's room.
  get scale(): number {
    return this.roomScale;
  }
  set scale(scale: number) {
    if (Math.abs(scale / this.roomScale - 1) < kSameScale) return;
    this.roomScale = scale;
    this.measure();
  }

  private measure(): void {
    this.fog.near = 1.3 * this.diagonal * this.roomScale;
    this.fog.far = 4 * this.diagonal * this.roomScale;
    sizeSoftShadow(this.key, this.sphere.radius * this.roomScale);
  }

  private get scheme(): Scheme {
    return this.dark.matches ? kEvening : kDay;
  }

  private light(): void {
    const { key, keyStrength, rim, rimStrength, room, sky: colours } = this.scheme;
    this.key.color.set(key);
    this.key.intensity = keyStrength;
    this.rim.color.set(rim);
    this.rim.intensity = rimStrength;
    const sky = new Sky(colours, kKeyDirection, kRimDirection);
    this.ambient.sh.copy(sky.probe());
    this.fog.color.set(room.outside);
    this.background.set(room.outside);
    if (this.detail === "full") this.sky = sky;
  }
}
