// SPDX-License-Identifier: MIT
// The real room of the user: hides cloth behind its surfaces, takes the cloth's shadow, and lets the cloth lie on them.

import * as THREE from "three";
import { kMostSurfaceTriangles, type Surfaces } from "@clothstream/client";
import { DetectedSurfaces, type DetectedSurface } from "./detected_surfaces";
import type { Placement } from "./placement";
import { nearestTriangles, type RoomMesh } from "./room_mesh";

// Time between two readings of the room, and between two changes at the server, ms.
const kPeriodMs = 500;
// Time until refused surfaces are sent again, ms.
const kPauseMs = 10_000;
// Surfaces at the server, at most: those that a participant may have (docs/limits.md).
const kMostSurfaces = 64;
// Changes of a pose that are the noise of tracking: 1 mm, and 1 mm at 2 m.
const kSamePlace = 1e-3;
const kSameTurn = 5e-4; // rad
// The part of a large mesh that is at the server is chosen again when the scene has moved by this, m.
const kSameCentre = 0.5;
// A part of a large mesh stays at the server while it has this part of the triangles that it may have.
const kEnough = 0.75;
// A refusal of a mesh with more triangles is about triangles; of others, about the number of surfaces.
const kFewTriangles = 100;
// Fewer triangles of the room are not tried.
const kFewest = 500;
const kLargestPlace = 100; // m; the server refuses larger numbers
const kShadowOpacity = 0.4;

interface Drawn {
  geometry: THREE.BufferGeometry;
  parts: THREE.Mesh[];
  version: number;
}

// Shape and place of a surface that the server has.
interface Sent {
  version: number;
  scale: number;
  triangles: number;
  centre: THREE.Vector3; // of the scene, in the room
  position: THREE.Vector3;
  turn: THREE.Quaternion;
}

export class RealRoom {
  // In room coordinates.
  readonly group = new THREE.Group();
  // Whether surfaces go to the server. Turned off, update() takes them back.
  shares = false;
  private readonly detected = new DetectedSurfaces();
  private readonly drawn = new Map<number, Drawn>();
  private readonly sent = new Map<number, Sent>();
  private surfaces: Surfaces | undefined; // that have them
  // Room at the server: triangles of all surfaces together, and surfaces.
  private mostTriangles = kMostSurfaceTriangles;
  private mostSurfaces = kMostSurfaces;
  private readonly leftOut = new Set<number>(); // surfaces for which the server has no room
  private readAt = -Infinity; // ms
  private isOn = false;
  // Writes depth only, a little behind the surface, so that cloth that lies on it is in front of it.
  private readonly cover = new THREE.MeshBasicMaterial({ colorWrite: false, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 });
  private readonly shade = new THREE.ShadowMaterial({ opacity: kShadowOpacity, depthWrite: false });

  // Starts to read and share the surfaces of a session, if it detects any.
  begin(session: XRSession): void {
    this.isOn = this.shares = DetectedSurfaces.detects(session);
    this.makeRoom();
    this.readAt = -Infinity;
  }

  // Whether the session detects surfaces. A headset may refuse.
  get detects(): boolean {
    return this.isOn;
  }
  // Surfaces of the room, and of these the ones that the server has.
  get counts(): { detected: number; sent: number } {
    return { detected: this.drawn.size, sent: this.sent.size };
  }

  // Reads the room and sends what has changed, at most twice per second. Call in each frame. `centre` is the middle of the
  // scene in the room. While the user moves the scene (isMoving), nothing new is sent. Without surfaces of a client, nothing
  // is sent.
  update(frame: XRFrame, space: XRReferenceSpace, placement: Placement, centre: THREE.Vector3, isMoving: boolean, surfaces: Surfaces | undefined, nowMs: number): void {
    if (!this.isOn || nowMs - this.readAt < kPeriodMs) return;
    this.readAt = nowMs;
    this.detected.read(frame, space);
    this.draw();
    if (surfaces && surfaces !== this.surfaces) {
      // A client that has joined another scene has none.
      this.surfaces = surfaces;
      this.sent.clear();
      this.makeRoom();
    }
    if (surfaces && !this.shares) this.takeBack(surfaces);
    else if (surfaces) this.send(surfaces, placement, centre, isMoving);
  }

  // The server has no room for a surface, so less of the room is sent. Returns false if this surface is left out.
  refused(id: number): boolean {
    const known = this.sent.get(id);
    if (!known) return true; // it is gone already
    this.sent.delete(id);
    const isSmall = known.triangles <= kFewTriangles;
    if (isSmall) this.mostSurfaces = this.sent.size;
    else this.mostTriangles = Math.floor(this.mostTriangles / 2);
    if (isSmall ? this.mostSurfaces > 0 : this.mostTriangles >= kFewest) return true;
    this.surfaces?.remove(id);
    this.leftOut.add(id);
    this.mostSurfaces = Math.max(1, this.mostSurfaces);
    this.mostTriangles = Math.max(kFewest, this.mostTriangles);
    return false;
  }

  // The server has refused a surface, and does not say which: half as much is sent after a pause. Nothing is shared any more
  // if that is too little.
  tryLater(nowMs: number): void {
    this.shares &&= this.mostSurfaces > 1;
    this.mostTriangles = Math.max(kFewest, Math.floor(this.mostTriangles / 2));
    this.mostSurfaces = Math.max(1, Math.floor(this.mostSurfaces / 2));
    this.readAt = nowMs + kPauseMs;
    for (const known of this.sent.values()) known.version = -1;
  }

  // Takes everything back, at the end of a session. `surfaces` are those of the present client.
  end(surfaces: Surfaces): void {
    this.takeBack(surfaces);
    this.isOn = this.shares = false;
    this.detected.forget();
    for (const id of [...this.drawn.keys()]) this.erase(id);
  }

  private makeRoom(): void {
    this.mostTriangles = kMostSurfaceTriangles;
    this.mostSurfaces = kMostSurfaces;
    this.leftOut.clear();
  }

  private takeBack(surfaces: Surfaces): void {
    if (surfaces === this.surfaces) for (const id of this.sent.keys()) surfaces.remove(id);
    this.sent.clear();
  }

  private send(surfaces: Surfaces, placement: Placement, centre: THREE.Vector3, isMoving: boolean): void {
    const chosen = this.chosen(centre);
    for (const id of this.sent.keys()) {
      if (chosen.some((one) => one.id === id)) continue;
      surfaces.remove(id);
      this.sent.delete(id);
    }
    if (isMoving) return;
    let left = this.mostTriangles;
    for (const surface of chosen) left -= this.sendOne(surfaces, surface, placement, centre, left);
  }

  // The nearest surfaces, those of few triangles first.
  private chosen(centre: THREE.Vector3): DetectedSurface[] {
    const usable = this.detected.all.filter(({ id, mesh }) => mesh && !this.leftOut.has(id));
    const away = ({ pose }: DetectedSurface) => new THREE.Vector3().setFromMatrixPosition(pose).distanceTo(centre);
    const near = usable.map((surface) => ({ surface, distance: away(surface) })).sort((a, b) => a.distance - b.distance);
    return near.slice(0, this.mostSurfaces).map(({ surface }) => surface).sort((a, b) => a.mesh!.triangles.length - b.mesh!.triangles.length || a.id - b.id);
  }

  // Returns how many triangles of the surface the server has then. `left` is how many it may have.
  private sendOne(surfaces: Surfaces, { id, mesh, pose, version }: DetectedSurface, { inverse, scale }: Placement, centre: THREE.Vector3, left: number): number {
    const position = new THREE.Vector3();
    const turn = new THREE.Quaternion();
    new THREE.Matrix4().multiplyMatrices(inverse, pose).decompose(position, turn, new THREE.Vector3());
    const all = mesh!.triangles.length / 3;
    const most = Math.min(left, all);
    const known = this.sent.get(id);
    const isWhole = known?.triangles === all && all <= left;
    const isEnough = known !== undefined && known.triangles <= left && known.triangles >= kEnough * most && known.centre.distanceTo(centre) < kSameCentre;
    const hasMesh = known !== undefined && known.version === version && known.scale === scale && (isWhole || isEnough);
    const isThere = known !== undefined && known.position.distanceTo(position) < kSamePlace && known.turn.angleTo(turn) < kSameTurn;
    if (hasMesh && isThere) return known.triangles;
    const { x, y, z, w } = turn;
    const isNear = Math.max(...position.toArray().map(Math.abs)) <= kLargestPlace;
    if (hasMesh && isNear) {
      surfaces.move(id, position.toArray(), [x, y, z, w]);
      known.position.copy(position);
      known.turn.copy(turn);
      return known.triangles;
    }
    const part = isNear ? nearestTriangles(mesh!, centre.clone().applyMatrix4(pose.clone().invert()), most) : undefined;
    const inScene = part && scaled(part, 1 / scale);
    if (!inScene || !surfaces.set({ id, ...inScene, position: position.toArray(), orientation: [x, y, z, w] })) {
      if (this.sent.delete(id)) surfaces.remove(id);
      return 0;
    }
    const triangles = part.triangles.length / 3;
    this.sent.set(id, { version, scale, triangles, centre: centre.clone(), position, turn });
    return triangles;
  }

  private draw(): void {
    const { all } = this.detected;
    for (const id of [...this.drawn.keys()]) if (!all.some((one) => one.id === id && one.mesh)) this.erase(id);
    for (const { id, mesh, pose, version } of all) {
      if (!mesh) continue;
      if (this.drawn.get(id)?.version !== version) {
        this.erase(id);
        this.drawn.set(id, this.make(mesh, version));
      }
      for (const part of this.drawn.get(id)!.parts) {
        part.matrix.copy(pose);
        part.matrixWorldNeedsUpdate = true;
      }
    }
  }

  private make({ positions, triangles }: RoomMesh, version: number): Drawn {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
    const parts = [new THREE.Mesh(geometry, this.cover), new THREE.Mesh(geometry, this.shade)];
    for (const part of parts) {
      part.matrixAutoUpdate = false;
      this.group.add(part);
    }
    // Before everything that it hides.
    parts[0]!.renderOrder = -1;
    parts[1]!.receiveShadow = true;
    return { geometry, parts, version };
  }

  private erase(id: number): void {
    const drawn = this.drawn.get(id);
    if (!drawn) return;
    for (const part of drawn.parts) this.group.remove(part);
    drawn.geometry.dispose();
    this.drawn.delete(id);
  }
}

// The mesh in metres of the scene, without triangles that would be too far away there.
function scaled({ positions, triangles }: RoomMesh, factor: number): RoomMesh | undefined {
  if (factor === 1) return { positions, triangles };
  const larger = positions.map((value) => value * factor);
  const isNear = (vertex: number) => Math.max(Math.abs(larger[3 * vertex]!), Math.abs(larger[3 * vertex + 1]!), Math.abs(larger[3 * vertex + 2]!)) <= kLargestPlace;
  if (larger.every((value) => Math.abs(value) <= kLargestPlace)) return { positions: larger, triangles };
  const near: number[] = [];
  for (let at = 0; at < triangles.length; at += 3) {
    const corners = [triangles[at]!, triangles[at + 1]!, triangles[at + 2]!];
    if (corners.every(isNear)) near.push(...corners);
  }
  if (near.length === 0) return undefined;
  const kept = Float32Array.from(larger, (value) => THREE.MathUtils.clamp(value, -kLargestPlace, kLargestPlace));
  return { positions: kept, triangles: Uint32Array.from(near) };
}
