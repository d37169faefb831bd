// SPDX-License-Identifier: MIT
// Typed interface to one client of the core: messages in and out, and the contents of the newest frame.

import {
  CS_CLOTH_REPORT_VERSION,
  CS_CLOTH_SETTINGS_VERSION,
  cs_cloth,
  cs_cloth_parameters,
  cs_cloth_point,
  cs_cloth_report,
  cs_cloth_settings,
  cs_collider,
  cs_environment,
  cs_grab,
  cs_grab_event,
  cs_pairing_code,
  cs_participant,
  cs_play_out_options,
  cs_playback,
  cs_statistics,
  cs_submesh,
} from "./layout";
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
  token: 8192,
  pairingCode: 16384,
} as const;

// Values of Client.errorCode after which a person must give a token or a pairing code.
export const kUnauthenticated = 60;
export const kWrongPairingCode = 61;

export interface PairingCode {
  code: string;
  role: number;
  validSeconds: number;
}

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

// Point of a cloth as it is shown. The core knows the rest of it.
export interface ClothPoint {
  position: Vec3;
  distance: number; // from the origin of the ray, m
  place: Uint8Array; // cs_cloth_point
}

// Grab of the cloth at a place, which is drawn to the position.
export interface Grab {
  id: number;
  position: Vec3;
  place: Uint8Array;
}

// Bytes of the memory that the core writes structs to: enough for each of them.
const kScratchBytes = Math.max(
  cs_statistics.sizeof,
  cs_cloth.sizeof,
  cs_submesh.sizeof,
  cs_collider.sizeof,
  cs_environment.sizeof,
  cs_cloth_parameters.sizeof,
  cs_cloth_point.sizeof,
  cs_cloth_report.sizeof,
  cs_cloth_settings.sizeof,
  cs_grab.sizeof,
  cs_grab_event.sizeof,
  cs_pairing_code.sizeof,
  cs_participant.sizeof,
  cs_play_out_options.sizeof,
  cs_playback.sizeof,
);

const kFarthestPoint = 1e4; // m

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

  // Token or code that the next connection sends before Hello; a newer call replaces an older one. "" means none.
  setToken(token: string): void {
    this.core.with([token], (text) => this.core.exports.cs_set_token(this.handle, text!));
  }
  setPairingCode(code: string): void {
    this.core.with([code], (text) => this.core.exports.cs_set_pairing_code(this.handle, text!));
  }
  // Token in use: that of setToken, or of the server after pairing.
  get token(): string {
    return this.core.text(this.core.exports.cs_token(this.handle));
  }

  // Requests a code by which others become participants. ClientEvent.pairingCode or ClientEvent.error follows.
  createPairingCode(): void {
    this.core.exports.cs_create_pairing_code(this.handle, 0);
  }
  // The newest code.
  pairingCode(): PairingCode | undefined {
    if (this.core.exports.cs_get_pairing_code(this.handle, this.scratch) === 0) return undefined;
    const view = this.core.view();
    return {
      code: this.core.text(view.getUint32(this.scratch + cs_pairing_code.code, true)),
      role: view.getUint32(this.scratch + cs_pairing_code.role, true),
      validSeconds: view.getUint32(this.scratch + cs_pairing_code.valid_s, true),
    };
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
      const id = view.getBigUint64(at + cs_participant.id, true);
      const program = this.core.text(view.getUint32(at + cs_participant.client_name, true));
      return {
        id,
        name: this.core.text(view.getUint32(at + cs_participant.name, true)) || program || "unnamed",
        role: view.getUint32(at + cs_participant.role, true),
        away: view.getInt32(at + cs_participant.away, true) !== 0,
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
  get errorCode(): number {
    return this.core.exports.cs_error_code(this.handle);
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
  // Frames per second of the stream.
  get streamRate(): number {
    return this.core.exports.cs_stream_rate(this.handle);
  }
  // n if the server sends only each n-th frame, because its device is overloaded; else 1.
  get frameDivisor(): number {
    return this.core.exports.cs_frame_divisor(this.handle);
  }
  get vertexCount(): number {
    return this.core.exports.cs_vertex_count(this.handle);
  }

  statistics(): Statistics {
    this.core.exports.cs_get_statistics(this.handle, nowUs(), this.scratch);
    const view = this.core.view();
    const count = (offset: number) => Number(view.getBigUint64(this.scratch + offset, true));
    const real = (offset: number) => view.getFloat64(this.scratch + offset, true);
    return {
      tick: count(cs_statistics.tick),
      frames: count(cs_statistics.frames),
      keyFrames: count(cs_statistics.key_frames),
      dropped: count(cs_statistics.dropped),
      decodeErrors: count(cs_statistics.decode_errors),
      bytes: count(cs_statistics.bytes),
      hashMismatches: count(cs_statistics.hash_mismatches),
      framesPerSecond: real(cs_statistics.frames_per_second),
      kbitPerSecond: real(cs_statistics.kbit_per_second),
      bitsPerVertex: real(cs_statistics.bits_per_vertex),
      roundTripMs: real(cs_statistics.round_trip_ms),
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
      name: this.core.text(view.getUint32(at + cs_cloth.name, true)),
      firstVertex: view.getUint32(at + cs_cloth.first_vertex, true),
      vertexCount: view.getUint32(at + cs_cloth.vertex_count, true),
      rows: view.getUint32(at + cs_cloth.rows, true),
      columns: view.getUint32(at + cs_cloth.columns, true),
      firstIndex: view.getUint32(at + cs_cloth.first_index, true),
      indexCount: view.getUint32(at + cs_cloth.index_count, true),
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
        name: this.core.text(view.getUint32(at + cs_submesh.name, true)),
        firstIndex: view.getUint32(at + cs_submesh.first_index, true),
        indexCount: view.getUint32(at + cs_submesh.index_count, true),
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
      name: this.core.text(view.getUint32(at + cs_collider.name, true)),
      shape: view.getUint32(at + cs_collider.shape, true),
      position: vec3(view, at + cs_collider.position),
      orientation: quaternion(view, at + cs_collider.orientation),
      radius: view.getFloat32(at + cs_collider.radius, true),
      length: view.getFloat32(at + cs_collider.length, true),
      size: vec3(view, at + cs_collider.size),
      participantId: view.getBigUint64(at + cs_collider.participant_id, true),
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
      gravity: vec3(view, this.scratch + cs_environment.gravity),
      wind: vec3(view, this.scratch + cs_environment.wind),
      airDensity: view.getFloat32(this.scratch + cs_environment.air_density, true),
      gustStrength: view.getFloat32(this.scratch + cs_environment.gust_strength, true),
      gustSeconds: view.getFloat32(this.scratch + cs_environment.gust_seconds, true),
    };
  }

  // Current parameters of each cloth.
  clothParameters(): ClothParameters[] {
    const count = this.core.exports.cs_cloth_count(this.handle);
    return this.list(count, this.core.exports.cs_get_cloth_parameters, (view, at) => ({
      structural: spring(view, at + cs_cloth_parameters.structural),
      shear: spring(view, at + cs_cloth_parameters.shear),
      bend: spring(view, at + cs_cloth_parameters.bend),
      damping: view.getFloat32(at + cs_cloth_parameters.damping, true),
    }));
  }

  // Solver of a cloth as a cs_solver.
  solver(cloth: number): number {
    this.core.view().setUint32(this.scratch + cs_cloth_settings.version, CS_CLOTH_SETTINGS_VERSION, true);
    if (this.core.exports.cs_get_cloth_settings(this.handle, cloth, this.scratch) === 0) return 0;
    return this.core.view().getUint32(this.scratch + cs_cloth_settings.solver, true);
  }

  // Selects a solver. The cloth keeps the settings that it last had for this solver, or the defaults.
  setSolver(cloth: string, solver: number): void {
    this.core.exports.cs_keep_cloth_settings(this.scratch);
    this.core.view().setUint32(this.scratch + cs_cloth_settings.solver, solver, true);
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
    this.core.view().setUint32(this.scratch + cs_cloth_report.version, CS_CLOTH_REPORT_VERSION, true);
    if (this.core.exports.cs_get_cloth_report(this.handle, cloth, this.scratch) === 0) return undefined;
    const view = this.core.view();
    const real = (offset: number) => view.getFloat32(this.scratch + offset, true);
    return {
      activeConstraints: view.getUint32(this.scratch + cs_cloth_report.active_constraints, true),
      iterations: view.getUint32(this.scratch + cs_cloth_report.iterations, true),
      residual: real(cs_cloth_report.residual),
      strainMax: real(cs_cloth_report.strain_max),
      strainP99: real(cs_cloth_report.strain_p99),
      strainMean: real(cs_cloth_report.strain_mean),
      kineticEnergy: real(cs_cloth_report.kinetic_energy),
      elasticEnergy: real(cs_cloth_report.elastic_energy),
      gravityEnergy: real(cs_cloth_report.gravity_energy),
      penetration: real(cs_cloth_report.penetration),
      deviceMs: real(cs_cloth_report.device_ms),
      tick: Number(view.getBigUint64(this.scratch + cs_cloth_report.tick, true)),
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
        participant: view.getBigUint64(at + cs_grab_event.participant_id, true),
        grab: view.getUint32(at + cs_grab_event.grab_id, true),
        vertices: view.getUint32(at + cs_grab_event.vertices, true),
      }),
    );
    return events.filter(({ participant, vertices }) => participant === own && vertices === 0).map(({ grab }) => grab);
  }

  // Finds the first point of a cloth that a ray meets. The direction has length 1.
  castRay(origin: Vec3, direction: Vec3): ClothPoint | undefined {
    const found = this.core.with([origin, direction], (from, along) =>
      this.core.exports.cs_cast_ray(this.handle, from!, along!, kFarthestPoint, this.scratch),
    );
    if (found === 0) return undefined;
    const view = this.core.view();
    const float = (offset: number) => view.getFloat32(this.scratch + offset, true);
    const at = cs_cloth_point.position;
    return {
      position: [float(at), float(at + 4), float(at + 8)],
      distance: float(cs_cloth_point.distance),
      place: this.core.bytes(this.scratch, cs_cloth_point.sizeof).slice(),
    };
  }

  // Sets this participant's grab on the cloth; undefined releases it. A new id starts a new grab.
  setGrab(grab: Grab | undefined): void {
    const view = this.core.view();
    if (grab) {
      const set = (offset: number, values: readonly number[]) =>
        values.forEach((value, i) => view.setFloat32(this.scratch + offset + 4 * i, value, true));
      view.setUint32(this.scratch + cs_grab.id, grab.id, true);
      set(cs_grab.position, grab.position);
      set(cs_grab.orientation, [0, 0, 0, 0]); // not rotated
      // NaN: the server's default.
      for (const offset of [cs_grab.radius, cs_grab.reach, cs_grab.max_force, cs_grab.slip_distance]) set(offset, [NaN]);
      view.setUint32(this.scratch + cs_grab.has_place, 1, true);
      this.core.bytes(this.scratch + cs_grab.place, cs_cloth_point.sizeof).set(grab.place);
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
      length: view.getFloat64(this.scratch + cs_playback.length, true),
      position: view.getFloat64(this.scratch + cs_playback.position, true),
      speed: view.getFloat64(this.scratch + cs_playback.speed, true),
      loop: view.getInt32(this.scratch + cs_playback.loop, true) !== 0,
      paused: view.getInt32(this.scratch + cs_playback.paused, true) !== 0,
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

function quaternion(view: DataView, at: number): readonly [number, number, number, number] {
  return [...vec3(view, at), view.getFloat32(at + 12, true)];
}

function spring(view: DataView, at: number): Spring {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true)];
}
