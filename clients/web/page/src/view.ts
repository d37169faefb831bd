// SPDX-License-Identifier: MIT
// The picture: cloths and colliders of the newest frame, their surroundings, and an orbiting camera.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Shape, type Client, type Vec3 } from "@clothstream/client";
import {
  Cloths, ColliderMeshes, ConstraintLines, type Detail, Mirror, People, reachOf, RoomOutlines, type ColliderMesh,
} from "@clothstream/three";
import { Fingers } from "./fingers";
import { useSoftShadows } from "./soft_shadow";
import { Studio } from "./studio";

const kFieldOfView = 32; // degrees, vertical
const kViewDirection = new THREE.Vector3(0.42, 0.16, 1).normalize();
const kMargin = 1.0;
const kTurnStep = Math.PI / 36;
// Time for which the cloths are drawn with reduced detail and without reflections, so that they come soon, ms.
const kPlainMs = 500;
// Time for which nothing is drawn while the first frame of the stream is under way, ms. Compiling what is only the room
// would delay it.
const kWaitMs = 1000;

export class View {
  readonly camera = new THREE.PerspectiveCamera(kFieldOfView);
  readonly orbit: OrbitControls;
  readonly fingers: Fingers;
  readonly renderer: THREE.WebGLRenderer;
  private readonly studio: Studio;
  private readonly colliderMeshes = new ColliderMeshes();
  private readonly people = new People();
  private readonly rooms = new RoomOutlines();
  private readonly constraints = new ConstraintLines();
  private readonly mirror = new Mirror((on) => this.colliderMeshes.drawForMirror(on));
  drawsConstraints = false; // those that the newest report names
  private readonly bounds = new THREE.Box3(new THREE.Vector3(-1, 0, -1), new THREE.Vector3(1, 2, 1));
  private readonly cloths: Cloths;
  private readonly madeMs = performance.now();
  private plainSinceMs: number | undefined; // time of the first picture with cloths
  private refining = false;
  isComplete = false; // the picture has all its detail
  private isDrawn = false;
  private readonly eye = new THREE.Vector3();
  private isMoved = false; // by the user, since the last reset
  private floorHeight = 0;
  // Times of the last draw(), ms: play-out, local contact and copies into attributes; and the renderer.
  showMs = 0;
  renderMs = 0;

  // Throws if the browser does not provide WebGL 2.
  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly detail: Detail,
    gathersNormals = true, // computes normals on the graphics device where the stream has none
  ) {
    this.fingers = new Fingers(canvas);
    useSoftShadows();
    this.cloths = new Cloths("reduced", gathersNormals);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.BasicShadowMap;
    this.renderer.toneMapping = THREE.AgXToneMapping;
    this.renderer.toneMappingExposure = 1.35;
    this.studio = new Studio(this.renderer, detail, (reflections) => this.colliderMeshes.reflect(reflections));
    this.studio.scene.add(this.cloths.group, this.colliderMeshes.group, this.people.group, this.rooms.group);
    this.studio.scene.add(this.constraints.lines, this.mirror.group);
    this.orbit = new OrbitControls(this.camera, canvas);
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
    const damp = () => (this.orbit.enableDamping = !calm.matches);
    calm.addEventListener("change", damp);
    damp();
    this.orbit.dampingFactor = 0.12;
    this.orbit.addEventListener("start", () => (this.isMoved = true));
    this.fit();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  get scene(): THREE.Scene {
    return this.studio.scene;
  }

  // Box of the cloths and colliders, on the floor.
  get box(): THREE.Box3 {
    return this.bounds;
  }

  // Hides the drawn room, so that the real one is seen. hasFloor: others draw shadows on its floor.
  passThrough(on: boolean, hasFloor: boolean): void {
    this.studio.passThrough(on, hasFloor);
  }

  get colliders(): readonly ColliderMesh[] {
    return this.colliderMeshes.meshes;
  }

  // Names of other participants that are shown, and the places of their labels.
  get shownPeople(): People["shown"] {
    return this.people.shown;
  }

  // Drawn ends of constraints, three numbers each.
  get constraintEnds(): Float32Array {
    return this.constraints.ends;
  }

  get clothMeshes(): THREE.Mesh[] {
    return this.cloths.meshes;
  }

  // Loads topology and rest state of a new description, and fits the camera to them.
  describe(client: Client): void {
    this.cloths.describe(client);
    this.constraints.describe(client);
    this.rooms.show(client);
    this.bounds.copy(this.cloths.reach());
    this.colliderMeshes.describe();
    for (const collider of client.frames.colliders()) {
      if (collider.shape === Shape.plane) continue;
      const centre = new THREE.Vector3(...collider.position);
      const reach = reachOf(client, collider);
      this.bounds.expandByPoint(centre.clone().subScalar(reach)).expandByPoint(centre.addScalar(reach));
    }
    this.fit();
  }

  // Shows the current materials of the cloths. Call when parameters change.
  dress(client: Client): void {
    this.cloths.dress(client);
  }

  // Shows the names of the participants. Call when they change.
  name(client: Client): void {
    this.people.name(client.people.participants());
  }

  // Hides the head of the own body, and puts a mirror before its wearer: `eyes` and `look` in the scene. "" for no body.
  wear(body: string, eyes: THREE.Vector3, look: THREE.Vector3): void {
    this.colliderMeshes.wear(body);
    if (!body) return this.mirror.hide();
    const direction = look.clone().setY(0);
    if (direction.lengthSq() < 1e-6) direction.set(0, 0, -1);
    this.mirror.stand(eyes.clone().setY(this.floorHeight), direction.normalize());
  }

  get hasMirror(): boolean {
    return this.mirror.isShown;
  }

  // Shows the surfaces of the real rooms of others. Call when they change.
  showRooms(client: Client): void {
    this.rooms.show(client);
  }
  // Surfaces of the real rooms of others that are drawn.
  get roomSurfaces(): number {
    return this.rooms.count;
  }

  // Whether a collider of this participant yielded in the last drawn frame.
  get ownYields(): boolean {
    return this.people.ownYields;
  }

  // Draws the frame for a time of performance.now(). Reads the core's memory only during the call.
  draw(client: Client | undefined, now: number): void {
    const began = performance.now();
    // The last frame of the previous client stays until the description of a joining one arrives.
    const shows = client !== undefined && this.cloths.show(client, now);
    if (!this.drawsConstraints) this.constraints.clear();
    else if (shows) this.constraints.show(client);
    if (shows) {
      const colliders = client.frames.shownColliders();
      this.colliderMeshes.place(client, colliders);
      const { isPresenting } = this.renderer.xr;
      const eye = isPresenting ? this.renderer.xr.getCamera() : this.camera;
      this.people.place(colliders, this.studio.scene.worldToLocal(eye.getWorldPosition(this.eye)), !isPresenting);
    }
    if (!this.renderer.xr.isPresenting) this.orbit.update();
    this.studio.scale = this.scene.matrix.getMaxScaleOnAxis();
    this.studio.cheapShadows = this.detail === "reduced" || this.renderer.xr.isPresenting;
    this.isDrawn ||= (shows && client.frames.statistics().frames > 0) || began - this.madeMs >= kWaitMs;
    if (shows && this.isDrawn) this.refine(began);
    const shown = performance.now();
    if (this.isDrawn) this.renderer.render(this.studio.scene, this.camera);
    this.showMs = shown - began;
    this.renderMs = performance.now() - shown;
  }

  // Completes the picture some time after the first one with cloths. Reflections take several seconds on a software device,
  // and are not made in a headset.
  private refine(nowMs: number): void {
    this.plainSinceMs ??= nowMs;
    if (nowMs - this.plainSinceMs < kPlainMs) return;
    if (!this.renderer.xr.isPresenting) this.studio.complete();
    if (this.refining) return;
    this.refining = true;
    void this.cloths.refine(this.detail, (object) => this.compile(object)).then(() => (this.isComplete = true));
  }

  // Compiles the programs of an object, next to this thread where the browser can.
  private async compile(object: THREE.Object3D): Promise<void> {
    // Asking for it where it is missing would print a warning.
    const isParallel = this.renderer.extensions.has("KHR_parallel_shader_compile");
    if (isParallel) await this.renderer.compileAsync(object, this.camera, this.studio.scene);
    else this.renderer.compile(object, this.camera, this.studio.scene);
  }

  // Moves the camera to the default view, which shows the whole scene in a canvas of any shape.
  reset(): void {
    this.isMoved = false;
    const centre = this.bounds.getCenter(new THREE.Vector3());
    this.camera.position.copy(centre).add(kViewDirection);
    this.camera.lookAt(centre);
    this.camera.updateMatrixWorld();
    const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    const halfHeight = Math.tan(THREE.MathUtils.degToRad(kFieldOfView / 2)) / kMargin;
    const halfWidth = halfHeight * this.camera.aspect;
    let distance = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const offset = new THREE.Vector3(
        corner & 1 ? this.bounds.max.x : this.bounds.min.x,
        corner & 2 ? this.bounds.max.y : this.bounds.min.y,
        corner & 4 ? this.bounds.max.z : this.bounds.min.z,
      ).sub(centre);
      const spread = Math.max(Math.abs(offset.dot(right)) / halfWidth, Math.abs(offset.dot(up)) / halfHeight);
      distance = Math.max(distance, spread + offset.dot(kViewDirection));
    }
    const size = this.bounds.getSize(new THREE.Vector3()).length();
    this.camera.position.copy(centre).addScaledVector(kViewDirection, distance);
    this.camera.near = 0.01 * size;
    this.camera.far = 40 * size;
    this.camera.updateProjectionMatrix();
    this.orbit.target.copy(centre);
    this.orbit.minDistance = 0.1 * size;
    this.orbit.maxDistance = 6 * size;
    this.orbit.update();
  }

  // Turns the camera around its target, in steps of kTurnStep to the right and up.
  turn(right: number, up: number): void {
    this.isMoved = true;
    const offset = this.camera.position.clone().sub(this.orbit.target);
    const spherical = new THREE.Spherical().setFromVector3(offset);
    spherical.theta += right * kTurnStep;
    spherical.phi -= up * kTurnStep;
    this.camera.position.setFromSpherical(spherical.makeSafe()).add(this.orbit.target);
  }

  zoom(factor: number): void {
    this.isMoved = true;
    this.camera.position.sub(this.orbit.target).multiplyScalar(factor).add(this.orbit.target);
  }

  // Vector in the plane that faces the camera, metres.
  inViewPlane(right: number, up: number): THREE.Vector3 {
    return new THREE.Vector3(right, up, 0).applyQuaternion(this.camera.quaternion);
  }

  // Projects a point to CSS pixels of the page.
  project(point: Vec3): [number, number] {
    const projected = new THREE.Vector3(...point).project(this.camera);
    const frame = this.canvas.getBoundingClientRect();
    return [
      frame.left + ((projected.x + 1) / 2) * frame.width,
      frame.top + ((1 - projected.y) / 2) * frame.height,
    ];
  }

  // Half the width of the shadow map, m of the user's room.
  get shadowReach(): number {
    return this.studio.shadowReach;
  }

  // Position of a point's shadow on the floor, cast by the key light.
  shadowOf(point: Vec3): Vec3 {
    const light = this.studio.lightDirection;
    const reach = (point[1] - this.floorHeight) / light.y;
    return [point[0] - reach * light.x, this.floorHeight, point[2] - reach * light.z];
  }

  // Fits floor and lights to the bounds. The floor is y = 0 if the bounds end near it, and else their lower end.
  private fit(): void {
    const { min, max } = this.bounds;
    const size = max.distanceTo(min);
    this.floorHeight = Math.abs(min.y) < 0.5 * size ? 0 : min.y;
    min.y = Math.max(min.y, this.floorHeight);
    this.studio.fit(this.bounds, this.floorHeight);
    this.reset();
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0 || this.renderer.xr.isPresenting) return;
    const ratio = Math.min(window.devicePixelRatio, this.detail === "full" ? 2 : 1.25);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (!this.isMoved) this.reset();
    // The new size has cleared the picture. The first one waits for draw(), while the session connects.
    if (this.isDrawn) this.renderer.render(this.studio.scene, this.camera);
  }
}
