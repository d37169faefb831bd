// SPDX-License-Identifier: MIT
// The geometry of the newest frame and of the frame that is shown, and points of it. Returned views point into the
// core's memory, and are valid until the next call.

import {
  CS_CLOTH_POINT_VERSION,
  CS_CLOTH_VERSION,
  CS_COLLIDER_VERSION,
  CS_STAGE_STATISTICS_VERSION,
  CS_STATISTICS_VERSION,
  CS_SUBMESH_VERSION,
  cs_cloth,
  cs_cloth_point,
  cs_stage_statistics,
  cs_statistics,
  cs_submesh,
} from "./layout";
import { microseconds, nowUs, vec3, type CoreHandle } from "./handle";
import { readCollider, ShownColliders } from "./shown_colliders";
import { KeptView } from "./wasm";
import type { ClothLayout, ClothPoint, Collider, Drawing, Hull, Stages, Statistics, Vec3 } from "./types";

const kFarthestPoint = 1e4; // m

export class Frames {
  private playsOut = false;

  private readonly shown: ShownColliders;
  private readonly shownFloats: Record<"positions" | "normals", KeptView<Float32Array>>;

  constructor(private readonly handle: CoreHandle) {
    this.shown = new ShownColliders(handle);
    const keep = () => new KeptView(handle.core, (pointer, count) => handle.core.floats(pointer, count));
    this.shownFloats = { positions: keep(), normals: keep() };
  }

  // Plays frames out evenly, with a small delay. Without, the newest frame is shown.
  playOut(): void {
    const { exports } = this.handle.core;
    exports.cs_default_play_out(this.handle.scratch);
    if (exports.cs_set_play_out(this.handle.pointer, this.handle.scratch) === 0)
      throw new Error("The client core is of another release than this package");
    this.playsOut = true;
  }

  // Keeps the shown cloth in front of this participant's hands and colliders while the server's answer is under way.
  // Needs play-out.
  keepClothInFrontOfHands(on: boolean): void {
    this.handle.core.exports.cs_set_local_contact(this.handle.pointer, on ? 1 : 0);
  }
  // Length of the largest correction in the frame that is shown, m.
  get localCorrection(): number {
    return this.handle.core.exports.cs_local_correction(this.handle.pointer);
  }

  // Whether the server sends normals. Otherwise they are computed from the positions.
  get sendsNormals(): boolean {
    return this.handle.core.exports.cs_sends_normals(this.handle.pointer) !== 0;
  }
  // Hash of the newest decoded frame.
  get hash(): bigint {
    return BigInt.asUintN(64, this.handle.core.exports.cs_reconstruction_hash(this.handle.pointer));
  }
  // Packets that the decoder refused.
  get decodeErrors(): number {
    const { core, pointer } = this.handle;
    const at = this.handle.prepared(CS_STATISTICS_VERSION);
    core.exports.cs_get_statistics(pointer, 0n, at);
    return Number(core.view().getBigUint64(at + cs_statistics.decode_errors, true));
  }

  // Frames per second of the stream.
  get streamRate(): number {
    return this.handle.core.exports.cs_stream_rate(this.handle.pointer);
  }
  // n if the server sends only each n-th frame, because its device is overloaded; else 1.
  get divisor(): number {
    return this.handle.core.exports.cs_frame_divisor(this.handle.pointer);
  }
  get vertexCount(): number {
    return this.handle.core.exports.cs_vertex_count(this.handle.pointer);
  }

  // 3 floats per vertex. Rest positions before the first frame.
  positions(): Float32Array {
    return this.handle.core.floats(this.handle.core.exports.cs_positions(this.handle.pointer), 3 * this.vertexCount);
  }

  normals(): Float32Array {
    return this.handle.core.floats(this.handle.core.exports.cs_normals(this.handle.pointer), 3 * this.vertexCount);
  }

  // Chooses what to show at a time of performance.now(): the newest frame, or the result of play-out.
  showAt(displayMs: number): void {
    if (!this.playsOut) return;
    this.handle.core.exports.cs_play_out(this.handle.pointer, nowUs(), microseconds(displayMs), 0);
  }

  // Positions that the last showAt() chose.
  shownPositions(): Float32Array {
    if (!this.playsOut) return this.positions();
    return this.shownFloats.positions.at(this.handle.core.exports.cs_played_positions(this.handle.pointer), 3 * this.vertexCount);
  }

  // Normals of these positions. The first call after showAt() may have to compute them, and detaches views.
  shownNormals(): Float32Array {
    if (!this.playsOut) return this.normals();
    return this.shownFloats.normals.at(this.handle.core.exports.cs_played_normals(this.handle.pointer), 3 * this.vertexCount);
  }

  triangles(): Uint32Array {
    const pointer = this.handle.core.exports.cs_triangles(this.handle.pointer, this.handle.scratch);
    return this.handle.core.indices(pointer, this.handle.core.view().getUint32(this.handle.scratch, true));
  }

  cloths(): ClothLayout[] {
    const { exports } = this.handle.core;
    return this.handle.list(exports.cs_cloth_count(this.handle.pointer), CS_CLOTH_VERSION, exports.cs_get_cloth, (view, at) => ({
      name: this.handle.core.text(view.getUint32(at + cs_cloth.name, true)),
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
    const { exports } = this.handle.core;
    const uvs = exports.cs_uvs(this.handle.pointer, cloth, this.handle.scratch);
    const uvCount = this.handle.core.view().getUint32(this.handle.scratch, true);
    const uvIndices = exports.cs_uv_indices(this.handle.pointer, cloth, this.handle.scratch);
    const indexCount = this.handle.core.view().getUint32(this.handle.scratch, true);
    const submesh = (client: number, index: number, out: number) => exports.cs_get_submesh(client, cloth, index, out);
    return {
      uvs: this.handle.core.floats(uvs, 2 * uvCount).slice(),
      uvIndices: this.handle.core.indices(uvIndices, indexCount).slice(),
      submeshes: this.handle.list(exports.cs_submesh_count(this.handle.pointer, cloth), CS_SUBMESH_VERSION, submesh, (view, at) => ({
        name: this.handle.core.text(view.getUint32(at + cs_submesh.name, true)),
        firstIndex: view.getUint32(at + cs_submesh.first_index, true),
        indexCount: view.getUint32(at + cs_submesh.index_count, true),
      })),
    };
  }

  // Colliders of the newest frame.
  colliders(): Collider[] {
    const { cs_collider_count, cs_get_collider } = this.handle.core.exports;
    return this.handle.list(cs_collider_count(this.handle.pointer), CS_COLLIDER_VERSION, cs_get_collider, (view, at, index) =>
      readCollider(this.handle, view, at, index),
    );
  }

  // Colliders at the time of the last showAt(). The next call overwrites the list and its objects.
  shownColliders(): readonly Collider[] {
    const { pointer, core } = this.handle;
    const { exports } = core;
    if (this.playsOut) return this.shown.read(exports.cs_played_collider_count(pointer), exports.cs_get_played_collider);
    return this.shown.read(exports.cs_collider_count(pointer), exports.cs_get_collider);
  }

  // Vertices of a hull or mesh at the shown time, until the next call of this client. A mesh with joints moves them.
  hullVertices(collider: Collider): Float32Array {
    const { core, pointer, scratch } = this.handle;
    const vertices = core.exports.cs_get_hull(pointer, collider.index, scratch, scratch + 4, scratch + 8);
    return core.floats(vertices, 3 * core.view().getUint32(scratch, true));
  }

  // Copies the geometry of a collider that is a hull or a mesh.
  hull(collider: Collider): Hull {
    const { cs_get_hull } = this.handle.core.exports;
    const [vertexCount, triangles, indexCount] = [this.handle.scratch, this.handle.scratch + 4, this.handle.scratch + 8];
    const vertices = cs_get_hull(this.handle.pointer, collider.index, vertexCount, triangles, indexCount);
    const view = this.handle.core.view();
    return {
      vertices: this.handle.core.floats(vertices, 3 * view.getUint32(vertexCount, true)).slice(),
      triangles: this.handle.core.indices(view.getUint32(triangles, true), view.getUint32(indexCount, true)).slice(),
    };
  }

  // Finds the first point of the shown cloth that a ray meets. The direction has length 1.
  castRay(origin: Vec3, direction: Vec3): ClothPoint | undefined {
    const { core, pointer } = this.handle;
    const out = this.handle.prepared(CS_CLOTH_POINT_VERSION);
    const found = core.with([origin, direction], (from, along) => core.exports.cs_cast_ray(pointer, from!, along!, kFarthestPoint, out));
    return found ? this.point() : undefined;
  }

  // Finds the point of the shown cloth that is nearest to a point, within a distance in metres.
  nearestPoint(point: Vec3, maxDistance: number): ClothPoint | undefined {
    const { core, pointer } = this.handle;
    const out = this.handle.prepared(CS_CLOTH_POINT_VERSION);
    const found = core.with([point], (at) => core.exports.cs_nearest_point(pointer, at!, maxDistance, out));
    return found ? this.point() : undefined;
  }

  private point(): ClothPoint {
    const { core, scratch } = this.handle;
    const view = core.view();
    return {
      position: vec3(view, scratch + cs_cloth_point.position),
      distance: view.getFloat32(scratch + cs_cloth_point.distance, true),
      place: core.bytes(scratch, cs_cloth_point.sizeof).slice(),
    };
  }

  // Times of the newest frame and of play-out.
  stages(): Stages | undefined {
    const { scratch, pointer, core } = this.handle;
    if (core.exports.cs_get_stage_statistics(pointer, this.handle.prepared(CS_STAGE_STATISTICS_VERSION)) === 0) return undefined;
    const view = core.view();
    const real = (offset: number) => view.getFloat64(scratch + offset, true);
    return {
      framesWaiting: view.getUint32(scratch + cs_stage_statistics.frames_waiting, true),
      lateFrames: Number(view.getBigUint64(scratch + cs_stage_statistics.late_frames, true)),
      ledOnMs: real(cs_stage_statistics.led_on_ms),
      heldMs: real(cs_stage_statistics.held_ms),
      delayMs: real(cs_stage_statistics.delay_ms),
      wantedDelayMs: real(cs_stage_statistics.wanted_delay_ms),
      serverMs: real(cs_stage_statistics.server_ms),
      networkMs: real(cs_stage_statistics.network_ms),
      decodeMs: real(cs_stage_statistics.decode_ms),
      displayableMs: real(cs_stage_statistics.displayable_ms),
    };
  }

  statistics(): Statistics {
    this.handle.core.exports.cs_get_statistics(this.handle.pointer, nowUs(), this.handle.prepared(CS_STATISTICS_VERSION));
    const view = this.handle.core.view();
    const count = (offset: number) => Number(view.getBigUint64(this.handle.scratch + offset, true));
    const real = (offset: number) => view.getFloat64(this.handle.scratch + offset, true);
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
}
