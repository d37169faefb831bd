// SPDX-License-Identifier: MIT
// Typed interface to one client of the core: messages in and out, and the contents of the newest frame.

import type { CoreModule } from "./wasm";

export type Vec3 = readonly [number, number, number];

export enum ClientState {
  joining = 0,
  joined = 1,
  failed = 2,
  reconnecting = 3,
}

export const ClientEvent = {
  frame: 1,
  description: 2,
  notice: 4,
  error: 8,
  parameters: 16,
  scenes: 32,
  report: 64,
  grabs: 128,
  participants: 512,
  returned: 2048,
} as const;

export interface Statistics {
  tick: number;
  frames: number;
  keyFrames: number;
  dropped: number;
  decodeErrors: number;
  bytes: number;
  hashMismatches: number;
  framesPerSecond: number;
  kbitPerSecond: number;
  bitsPerVertex: number;
  roundTripMs: number;
}

export interface ClothLayout {
  name: string;
  firstVertex: number;
  vertexCount: number;
  rows: number;
  columns: number;
  firstIndex: number;
  indexCount: number;
}

// Texture coordinates and submeshes of a mesh. Empty for a grid.
export interface Drawing {
  uvs: Float32Array; // (u, v) pairs, v upwards; may be empty
  uvIndices: Uint32Array; // one per corner of the cloth's triangles
  submeshes: { name: string; firstIndex: number; indexCount: number }[]; // indices count in the scene's triangles
}

export enum Shape {
  sphere = 0,
  capsule = 1,
  plane = 2,
  box = 3,
  hull = 4,
}

// Lengths in metres, in the collider's own frame (core.h).
export interface Collider {
  index: number;
  name: string;
  shape: Shape;
  position: Vec3;
  orientation: readonly [number, number, number, number]; // quaternion x, y, z, w
  radius: number;
  length: number;
  size: Vec3;
  participantId: bigint; // 0 for a collider of the scene
}

// Vertices (3 floats each) and triangles (3 indices each).
export interface Hull {
  vertices: Float32Array;
  triangles: Uint32Array;
}

// Names of cs_role. A newer server may have more roles.
export const Roles: ReadonlyMap<number, string> = new Map([
  [1, "viewer"],
  [2, "participant"],
  [3, "owner"],
]);

export interface Participant {
  id: bigint;
  name: string; // the program's name if the participant has none
  role: number;
  away: boolean; // disconnected, within the reconnect grace
  self: boolean;
}

// Stiffness in N/m and damping in N s/m.
export type Spring = readonly [number, number];

export interface Environment {
  gravity: Vec3; // m/s^2
  wind: Vec3; // m/s
  airDensity: number; // kg/m^3
  gustStrength: number; // m/s
  gustSeconds: number;
}

export interface ClothParameters {
  structural: Spring;
  shear: Spring;
  bend: Spring;
  damping: number; // 1/s
}

// Names of cs_solver. A newer server may have more solvers.
export const Solvers: ReadonlyMap<number, string> = new Map([
  [1, "mass-spring"],
  [2, "constraint"],
  [3, "ACAD"],
  [4, "XPBD"],
  [5, "implicit Euler"],
]);

// Health of one cloth's simulation (cs_cloth_report). SI units; strains are fractions of a length.
export interface ClothReport {
  activeConstraints: number;
  iterations: number;
  residual: number;
  strainMax: number;
  strainP99: number;
  strainMean: number;
  kineticEnergy: number;
  elasticEnergy: number;
  gravityEnergy: number;
  penetration: number;
  deviceMs: number;
  tick: number;
}

// State of a recording that is played.
export interface Playback {
  length: number; // s
  position: number; // current time in the recording, s
  speed: number;
  loop: boolean;
  paused: boolean;
}

// Sizes of the structs of core.h on a 32-bit machine.
const kStatisticsBytes = 104;
const kClothBytes = 28;
const kColliderBytes = 64;
const kEnvironmentBytes = 28;
const kClothParametersBytes = 28;
const kClothReportBytes = 56;
const kClothReportVersion = 1;
const kClothSettingsBytes = 92;
const kClothSettingsVersion = 1;
const kGrabBytes = 48;
const kGrabEventBytes = 24;
const kParticipantBytes = 24;
const kSolverAt = 48; // in cs_cloth_settings
const kScratchBytes = Math.max(
  kStatisticsBytes,
  kClothBytes,
  kColliderBytes,
  kEnvironmentBytes,
  kClothParametersBytes,
  kClothReportBytes,
  kClothSettingsBytes,
  kGrabBytes,
  kGrabEventBytes,
  kParticipantBytes,
);

// A joining participant: displayed name, requested role, and whether frames are played out smoothly with a delay.
export interface Identity {
  name: string;
  role: number;
  smooth: boolean;
}

// Returned views (positions, normals, triangles) point into the core's memory. They are valid until the next call.
export class Client {
  private readonly handle: number;
  private readonly scratch: number;
  private readonly playsOut: boolean;
  private inbox = 0;
  private inboxBytes = 0;

  // An empty `scene` means the server's default scene; `name` may be empty. `role` is a key of Roles, or 0 for any.
  constructor(
    private readonly core: CoreModule,
    scene: string,
    { name, role, smooth }: Identity,
  ) {
    this.handle = core.with([scene, "clothstream page", name], (where, what, who) =>
      core.exports.cs_create_as(where!, what!, who!, role),
    );
    if (this.handle === 0) throw new Error("The client core has no memory left for another client");
    this.scratch = core.allocate(kScratchBytes);
    this.playsOut = smooth;
    if (!smooth) return;
    core.exports.cs_default_play_out(this.scratch);
    if (core.exports.cs_set_play_out(this.handle, this.scratch) === 0)
      throw new Error("The client core is of another release than the page");
  }

  destroy(): void {
    this.core.exports.cs_destroy(this.handle);
    this.core.exports.free(this.scratch);
    this.core.exports.free(this.inbox);
  }

  // Handles one ServerMessage. Returns ClientEvent bits.
  receive(message: ArrayBuffer): number {
    if (message.byteLength > this.inboxBytes) {
      this.core.exports.free(this.inbox);
      this.inboxBytes = 2 * message.byteLength;
      this.inbox = this.core.allocate(this.inboxBytes);
    }
    this.core.bytes(this.inbox, message.byteLength).set(new Uint8Array(message));
    return this.core.exports.cs_receive(this.handle, this.inbox, message.byteLength, nowUs());
  }

  // Starts a connection. The next outgoing message is Hello.
  connecting(): void {
    this.core.exports.cs_connecting(this.handle, nowUs());
  }

  // Ends a connection that was lost or could not be opened.
  disconnected(): void {
    this.core.exports.cs_disconnected(this.handle, nowUs());
  }

  // Time to drop the current connection, if any, and to open a new one; on the clock of performance.now().
  get connectAtMs(): number {
    return Number(BigInt.asUintN(64, this.core.exports.cs_connect_at(this.handle))) / 1000;
  }

  // Participants of the scene, in the order in which they joined.
  participants(): Participant[] {
    const own = this.core.exports.cs_participant_id(this.handle);
    const count = this.core.exports.cs_participant_count(this.handle);
    return this.list(count, this.core.exports.cs_get_participant, (view, at) => {
      const id = view.getBigUint64(at, true);
      const program = this.core.text(view.getUint32(at + 12, true));
      return {
        id,
        name: this.core.text(view.getUint32(at + 8, true)) || program || "unnamed",
        role: view.getUint32(at + 16, true),
        away: view.getInt32(at + 20, true) !== 0,
        self: id === own,
      };
    });
  }

  // Sends pings and runs timers. Call at least ten times per second.
  update(): void {
    this.core.exports.cs_update(this.handle, nowUs());
  }

  // Copy of the next ClientMessage to send.
  nextOutgoing(): Uint8Array<ArrayBuffer> | undefined {
    const message = this.core.exports.cs_next_outgoing(this.handle, this.scratch);
    if (message === 0) return undefined;
    return this.core.bytes(message, this.core.view().getUint32(this.scratch, true)).slice();
  }

  get state(): ClientState {
    return this.core.exports.cs_get_state(this.handle);
  }
  get errorText(): string {
    return this.core.text(this.core.exports.cs_error_text(this.handle));
  }
  get noticeText(): string {
    return this.core.text(this.core.exports.cs_notice_text(this.handle));
  }
  get deviceName(): string {
    return this.core.text(this.core.exports.cs_device_name(this.handle));
  }
  get sceneName(): string {
    return this.core.text(this.core.exports.cs_scene_name(this.handle));
  }
  get vertexCount(): number {
    return this.core.exports.cs_vertex_count(this.handle);
  }

  statistics(): Statistics {
    this.core.exports.cs_get_statistics(this.handle, nowUs(), this.scratch);
    const view = this.core.view();
    const count = (index: number) => Number(view.getBigUint64(this.scratch + 8 * index, true));
    const real = (index: number) => view.getFloat64(this.scratch + 8 * index, true);
    return {
      tick: count(0),
      frames: count(1),
      keyFrames: count(2),
      dropped: count(3),
      decodeErrors: count(4),
      bytes: count(5),
      hashMismatches: count(6),
      framesPerSecond: real(7),
      kbitPerSecond: real(8),
      bitsPerVertex: real(9),
      roundTripMs: real(10),
    };
  }

  // 3 floats per vertex. Rest positions before the first frame.
  positions(): Float32Array {
    return this.core.floats(this.core.exports.cs_positions(this.handle), 3 * this.vertexCount);
  }

  normals(): Float32Array {
    return this.core.floats(this.core.exports.cs_normals(this.handle), 3 * this.vertexCount);
  }

  // Vertices to draw at a time of performance.now(): the newest frame, or the result of play-out.
  shownAt(displayMs: number): { positions: Float32Array; normals: Float32Array } {
    if (!this.playsOut) return { positions: this.positions(), normals: this.normals() };
    const { exports } = this.core;
    exports.cs_play_out(this.handle, nowUs(), BigInt(Math.round(1000 * displayMs)), 0);
    // The first call may grow the memory, which detaches views.
    const normals = exports.cs_played_normals(this.handle);
    const positions = exports.cs_played_positions(this.handle);
    return {
      positions: this.core.floats(positions, 3 * this.vertexCount),
      normals: this.core.floats(normals, 3 * this.vertexCount),
    };
  }

  triangles(): Uint32Array {
    const pointer = this.core.exports.cs_triangles(this.handle, this.scratch);
    return this.core.indices(pointer, this.core.view().getUint32(this.scratch, true));
  }

  cloths(): ClothLayout[] {
    return this.list(this.core.exports.cs_cloth_count(this.handle), this.core.exports.cs_get_cloth, (view, at) => ({
      name: this.core.text(view.getUint32(at, true)),
      firstVertex: view.getUint32(at + 4, true),
      vertexCount: view.getUint32(at + 8, true),
      rows: view.getUint32(at + 12, true),
      columns: view.getUint32(at + 16, true),
      firstIndex: view.getUint32(at + 20, true),
      indexCount: view.getUint32(at + 24, true),
    }));
  }

  // Copies the texture coordinates and submeshes of a cloth.
  drawing(cloth: number): Drawing {
    const { exports } = this.core;
    const uvs = exports.cs_uvs(this.handle, cloth, this.scratch);
    const uvCount = this.core.view().getUint32(this.scratch, true);
    const uvIndices = exports.cs_uv_indices(this.handle, cloth, this.scratch);
    const indexCount = this.core.view().getUint32(this.scratch, true);
    const submesh = (client: number, index: number, out: number) => exports.cs_get_submesh(client, cloth, index, out);
    return {
      uvs: this.core.floats(uvs, 2 * uvCount).slice(),
      uvIndices: this.core.indices(uvIndices, indexCount).slice(),
      submeshes: this.list(exports.cs_submesh_count(this.handle, cloth), submesh, (view, at) => ({
        name: this.core.text(view.getUint32(at, true)),
        firstIndex: view.getUint32(at + 4, true),
        indexCount: view.getUint32(at + 8, true),
      })),
    };
  }

  // Colliders of the newest frame.
  colliders(): Collider[] {
    const { cs_collider_count, cs_get_collider } = this.core.exports;
    return this.readColliders(cs_collider_count(this.handle), cs_get_collider);
  }

  // Colliders at the time of the last shownAt().
  shownColliders(): Collider[] {
    if (!this.playsOut) return this.colliders();
    const { cs_played_collider_count, cs_get_played_collider } = this.core.exports;
    return this.readColliders(cs_played_collider_count(this.handle), cs_get_played_collider);
  }

  private readColliders(
    count: number,
    get: (client: number, index: number, out: number) => number,
  ): Collider[] {
    return this.list(count, get, (view, at, index) => ({
      index,
      name: this.core.text(view.getUint32(at, true)),
      shape: view.getUint32(at + 4, true),
      position: vec3(view, at + 8),
      orientation: [...vec3(view, at + 20), view.getFloat32(at + 32, true)] as const,
      radius: view.getFloat32(at + 36, true),
      length: view.getFloat32(at + 40, true),
      size: vec3(view, at + 44),
      participantId: view.getBigUint64(at + 56, true),
    }));
  }

  // Copies the geometry of a hull collider.
  hull(collider: Collider): Hull {
    const { cs_get_hull } = this.core.exports;
    const [vertexCount, triangles, indexCount] = [this.scratch, this.scratch + 4, this.scratch + 8];
    const vertices = cs_get_hull(this.handle, collider.index, vertexCount, triangles, indexCount);
    const view = this.core.view();
    return {
      vertices: this.core.floats(vertices, 3 * view.getUint32(vertexCount, true)).slice(),
      triangles: this.core.indices(view.getUint32(triangles, true), view.getUint32(indexCount, true)).slice(),
    };
  }

  scenes(): string[] {
    const count = this.core.exports.cs_scene_count(this.handle);
    return Array.from({ length: count }, (_, index) => this.core.text(this.core.exports.cs_scene(this.handle, index)));
  }

  // Current environment; undefined before the description.
  environment(): Environment | undefined {
    if (this.core.exports.cs_get_environment(this.handle, this.scratch) === 0) return undefined;
    const view = this.core.view();
    return {
      gravity: vec3(view, this.scratch),
      wind: vec3(view, this.scratch + 12),
      airDensity: view.getFloat32(this.scratch + 24, true),
      gustStrength: view.getFloat32(this.scratch + 28, true),
      gustSeconds: view.getFloat32(this.scratch + 32, true),
    };
  }

  // Current parameters of each cloth.
  clothParameters(): ClothParameters[] {
    const count = this.core.exports.cs_cloth_count(this.handle);
    return this.list(count, this.core.exports.cs_get_cloth_parameters, (view, at) => ({
      structural: spring(view, at),
      shear: spring(view, at + 8),
      bend: spring(view, at + 16),
      damping: view.getFloat32(at + 24, true),
    }));
  }

  // Solver of a cloth as a cs_solver.
  solver(cloth: number): number {
    this.core.view().setUint32(this.scratch, kClothSettingsVersion, true);
    if (this.core.exports.cs_get_cloth_settings(this.handle, cloth, this.scratch) === 0) return 0;
    return this.core.view().getUint32(this.scratch + kSolverAt, true);
  }

  // Selects a solver. The cloth keeps the settings that it last had for this solver, or the defaults.
  setSolver(cloth: string, solver: number): void {
    this.core.exports.cs_keep_cloth_settings(this.scratch);
    this.core.view().setUint32(this.scratch + kSolverAt, solver, true);
    this.core.with([cloth], (name) => this.core.exports.cs_change_cloth(this.handle, name!, this.scratch));
  }

  // Names of the available materials. material() is the material of a cloth, or "".
  materials(): string[] {
    const count = this.core.exports.cs_material_count(this.handle);
    return Array.from({ length: count }, (_, index) => this.core.text(this.core.exports.cs_material(this.handle, index)));
  }

  material(cloth: number): string {
    return this.core.text(this.core.exports.cs_cloth_material(this.handle, cloth));
  }

  setMaterial(cloth: string, material: string): void {
    this.core.with([cloth, material], (name, chosen) => this.core.exports.cs_set_material(this.handle, name!, chosen!));
  }

  setGust(strength: number, seconds: number): void {
    this.core.exports.cs_set_gust(this.handle, strength, seconds);
  }

  // Newest report of a cloth; undefined before the first.
  report(cloth: number): ClothReport | undefined {
    this.core.view().setUint32(this.scratch, kClothReportVersion, true);
    if (this.core.exports.cs_get_cloth_report(this.handle, cloth, this.scratch) === 0) return undefined;
    const view = this.core.view();
    const real = (place: number) => view.getFloat32(this.scratch + 4 * place, true);
    return {
      activeConstraints: view.getUint32(this.scratch + 4, true),
      iterations: view.getUint32(this.scratch + 8, true),
      residual: real(3),
      strainMax: real(4),
      strainP99: real(5),
      strainMean: real(6),
      kineticEnergy: real(7),
      elasticEnergy: real(8),
      gravityEnergy: real(9),
      penetration: real(10),
      deviceMs: real(11),
      tick: Number(view.getBigUint64(this.scratch + 48, true)),
    };
  }

  setEnvironment(change: { gravity?: Vec3; wind?: Vec3 }): void {
    this.core.with([change.gravity, change.wind], (gravity, wind) =>
      this.core.exports.cs_set_environment(this.handle, gravity!, wind!, 0),
    );
  }

  // Changes a cloth. An empty name means every cloth.
  setCloth(cloth: string, change: Partial<ClothParameters>): void {
    const damping = change.damping === undefined ? undefined : [change.damping];
    this.core.with([cloth, change.structural, change.shear, change.bend, damping], (name, structural, shear, bend, rate) =>
      this.core.exports.cs_set_cloth(this.handle, name!, structural!, shear!, bend!, rate!),
    );
  }

  // Ids of this participant's grabs that slipped off the cloth, according to the newest ClientEvent.grabs.
  lostGrabs(): number[] {
    const own = this.core.exports.cs_participant_id(this.handle);
    const events = this.list(
      this.core.exports.cs_grab_event_count(this.handle),
      this.core.exports.cs_get_grab_event,
      (view, at) => ({
        participant: view.getBigUint64(at, true),
        grab: view.getUint32(at + 8, true),
        vertices: view.getUint32(at + 16, true),
      }),
    );
    return events.filter(({ participant, vertices }) => participant === own && vertices === 0).map(({ grab }) => grab);
  }

  // Sets this participant's grab on the cloth; undefined releases it. A new id starts a new grab.
  setGrab(grab: { id: number; position: Vec3 } | undefined): void {
    const view = this.core.view();
    if (grab) {
      view.setUint32(this.scratch, grab.id, true);
      const turned = [0, 0, 0, 0];
      const byDefault = [NaN, NaN, NaN, NaN]; // radius, reach, force, slip distance
      [...grab.position, ...turned, ...byDefault].forEach((value, i) => view.setFloat32(this.scratch + 4 + 4 * i, value, true));
    }
    this.core.exports.cs_set_grabs(this.handle, this.scratch, grab ? 1 : 0, nowUs());
  }

  setCollider(collider: string, change: { position?: Vec3; radius?: number }): void {
    const radius = change.radius === undefined ? undefined : [change.radius];
    this.core.with([collider, change.position, radius], (name, position, size) =>
      this.core.exports.cs_set_collider(this.handle, name!, position!, size!),
    );
  }

  // State of the playback; undefined unless the scene is a recording.
  playback(): Playback | undefined {
    if (this.core.exports.cs_get_playback(this.handle, nowUs(), this.scratch) === 0) return undefined;
    const view = this.core.view();
    return {
      length: view.getFloat64(this.scratch, true),
      position: view.getFloat64(this.scratch + 8, true),
      speed: view.getFloat64(this.scratch + 16, true),
      loop: view.getInt32(this.scratch + 24, true) !== 0,
      paused: view.getInt32(this.scratch + 28, true) !== 0,
    };
  }

  // The four functions below act for every participant of the scene.
  pause(paused: boolean): void {
    this.core.exports.cs_pause(this.handle, paused ? 1 : 0);
  }
  seek(seconds: number): void {
    this.core.exports.cs_seek(this.handle, seconds);
  }
  setSpeed(speed: number): void {
    this.core.exports.cs_set_speed(this.handle, speed);
  }
  setLoop(loop: boolean): void {
    this.core.exports.cs_set_loop(this.handle, loop ? 1 : 0);
  }

  listScenes(): void {
    this.core.exports.cs_list_scenes(this.handle);
  }

  private list<Item>(
    count: number,
    get: (client: number, index: number, out: number) => number,
    read: (view: DataView, at: number, index: number) => Item,
  ): Item[] {
    const items: Item[] = [];
    for (let index = 0; index < count; ++index) {
      if (get(this.handle, index, this.scratch) !== 0) items.push(read(this.core.view(), this.scratch, index));
    }
    return items;
  }
}

function nowUs(): bigint {
  return BigInt(Math.round(performance.now() * 1000));
}

function vec3(view: DataView, at: number): Vec3 {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true)];
}

function spring(view: DataView, at: number): Spring {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true)];
}
