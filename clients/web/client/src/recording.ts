// SPDX-License-Identifier: MIT
// Reads recordings without a server (clients/recording/recording.h).

import { decompress } from "fzstd";
import {
  CS_RECORDED_COLLIDER_VERSION,
  CS_RECORDED_GRAB_VERSION,
  CS_RECORDED_TICK_VERSION,
  CS_RECORDED_VERSION,
  CS_RECORDING_FAULTS_VERSION,
  CS_RECORDING_INFO_VERSION,
  cs_recorded,
  cs_recorded_collider,
  cs_recorded_grab,
  cs_recorded_pose,
  cs_recorded_tick,
  cs_recording_faults,
  cs_recording_info,
} from "./layout";
import { Frames } from "./frames";
import { CoreHandle, readFloats, vec3 } from "./handle";
import { readGrabEvents } from "./input";
import { Parameters } from "./parameters";
import { People } from "./people";
import { CoreModule, type RecordingExports } from "./wasm";
import type { GrabEvent, Quaternion, Shape, Vec3 } from "./types";

// Kinds of messages (CS_RECORDED). A set of them is their sum.
export const Recorded = {
  frame: 1,
  parameters: 2,
  events: 4,
  notice: 8,
  participant: 16,
  // The journal, which only servers write.
  scene: 32,
  tick: 64,
  checkpoint: 128,
  all: 255,
} as const;

// Bytes that are read when they are needed. In a worker, FileReaderSync reads a File without loading all of it.
export interface RecordingSource {
  size: number; // bytes
  // Fills `into` with the bytes from `offset` on, which lie within the size. Throws if they cannot be read.
  read(offset: number, into: Uint8Array): void;
}

export interface RecordingOptions {
  // clothstream_recording.wasm: its address, its bytes, or the compiled module, which several recordings may share.
  // Default: the file next to this module.
  wasm?: string | URL | BufferSource | WebAssembly.Module;
  // Most vertices of all cloths, 1 to 67108864, and half of the most triangles. A larger recording is refused. Default:
  // 1048576.
  maxVertices?: number;
}

export interface RecordingInfo {
  complete: boolean; // false: the file is cut or damaged at its end, and is read up to there
  seconds: number; // from the first message to the last
  startNs: bigint; // since 1970
  bytes: number;
  frames: number; // 0 if the file is not complete
  ticks: number; // 0 in recordings of clients
}

// Frames that were read so far and cannot be shown as they were recorded.
export interface RecordingFaults {
  frames: number; // all frames; frames that are read again after a seek count again
  undecodable: number; // the decoder refused them
  different: number; // decoded, but different from their recorded hash
  firstTick: bigint; // of the first such frame; 0 if its header cannot be read
  firstSeconds: number; // since the start of the recording
}

export interface RecordedMessage {
  kind: number; // a value of Recorded
  events: number; // ClientEvent bits: what changed
  key: boolean; // a frame that can be decoded without earlier ones
  seconds: number; // since the start of the recording
  tick: bigint; // 0 for notices, participants and the scene
  reconstructionHash: bigint; // of a frame, as the server stated it; compare with Recording.hash
  stateHash: bigint; // of a frame or tick
}

export interface RecordedPose {
  position: Vec3;
  orientation: Quaternion;
}

export interface RecordedCollider {
  participantId: bigint; // 0: the scene
  id: number;
  shape: Shape;
  start: RecordedPose; // at the start of the tick
  end: RecordedPose;
  friction: number;
  radius: number;
  topRadius: number; // as of Collider
  length: number;
  size: Vec3;
}

export interface RecordedGrab {
  state: number; // 0: holds nothing; 1: holds; 2: takes
  start: RecordedPose;
  end: RecordedPose;
  radius: number; // m
  reach: number; // m
  maxForce: number; // N
  slipDistance: number; // m
}

export interface RecordedTick {
  tick: bigint;
  stateHash: bigint;
  recovery: number; // 0: none; 1: rollback; 2: reset
  unhealthy: boolean;
  savesState: boolean;
  gravity: Vec3; // m/s^2
  wind: Vec3; // m/s, gust included
  airDensity: number; // kg/m^3
  substeps: number; // 0: as many as the scene has
  colliders: RecordedCollider[];
  attachments: RecordedPose[];
  grabs: RecordedGrab[];
}

export interface RecordedState {
  tick: bigint; // after which it holds
  nodes: Float32Array; // 6 floats per node: position (m) and velocity (m/s); valid until the next call
}

// Opens a recording. Throws if it cannot be read; the message says why.
export async function openRecording(source: ArrayBuffer | Uint8Array | RecordingSource, options: RecordingOptions = {}): Promise<Recording> {
  const bytes = source instanceof ArrayBuffer || source instanceof Uint8Array ? memorySource(source) : source;
  const module = await compile(options.wasm ?? new URL("./clothstream_recording.wasm", import.meta.url));
  return Recording.open(bytes, module, options.maxVertices ?? 0);
}

function memorySource(source: ArrayBuffer | Uint8Array): RecordingSource {
  const bytes = source instanceof Uint8Array ? source : new Uint8Array(source);
  return { size: bytes.length, read: (offset, into) => into.set(bytes.subarray(offset, offset + into.length)) };
}

async function compile(wasm: NonNullable<RecordingOptions["wasm"]>): Promise<WebAssembly.Module> {
  if (wasm instanceof WebAssembly.Module) return wasm;
  if (typeof wasm === "string" || wasm instanceof URL) return CoreModule.compile(wasm);
  return WebAssembly.compile(wasm);
}

// Runs an import of the module. WebAssembly cannot catch, so that an error becomes the result 0.
function succeeded(body: () => boolean): number {
  try {
    return body() ? 1 : 0;
  } catch {
    return 0;
  }
}

// A recording that is played. All members describe the place up to which it was read.
export class Recording {
  readonly frames: Frames;
  readonly parameters: Parameters;
  readonly people: People;
  private readonly handle: CoreHandle;

  private constructor(
    private readonly core: CoreModule<RecordingExports>,
    private readonly pointer: number,
  ) {
    this.handle = new CoreHandle(core, core.exports.cs_recording_client(pointer));
    this.frames = new Frames(this.handle);
    this.parameters = new Parameters(this.handle);
    this.people = new People(this.handle);
  }

  static async open(source: RecordingSource, module: WebAssembly.Module, maxVertices: number): Promise<Recording> {
    const core: CoreModule<RecordingExports> = await CoreModule.startWith<RecordingExports>(module, {
      clothstream: {
        read: (_source: number, offset: number, out: number, count: number) =>
          succeeded(() => {
            source.read(offset, core.bytes(out, count));
            return true;
          }),
        decompress: (frame: number, frameBytes: number, out: number, size: number) =>
          succeeded(() => decompress(core.bytes(frame, frameBytes), core.bytes(out, size)).length === size),
      },
    });
    const pointer = core.exports.cs_recording_open_host(0, source.size, maxVertices);
    if (core.exports.cs_recording_is_open(pointer) === 0) throw new Error(core.text(core.exports.cs_recording_error_text(pointer)));
    return new Recording(core, pointer);
  }

  close(): void {
    this.core.exports.free(this.handle.scratch);
    this.core.exports.cs_recording_close(this.pointer);
  }

  get info(): RecordingInfo {
    const at = this.handle.prepared(CS_RECORDING_INFO_VERSION);
    this.core.exports.cs_recording_get_info(this.pointer, at);
    const view = this.core.view();
    return {
      complete: view.getInt32(at + cs_recording_info.complete, true) !== 0,
      seconds: view.getFloat64(at + cs_recording_info.seconds, true),
      startNs: view.getBigUint64(at + cs_recording_info.start_ns, true),
      bytes: Number(view.getBigUint64(at + cs_recording_info.bytes, true)),
      frames: Number(view.getBigUint64(at + cs_recording_info.frames, true)),
      ticks: Number(view.getBigUint64(at + cs_recording_info.ticks, true)),
    };
  }

  // Counts of frames with faults. A recording that was read without an error has none.
  get faults(): RecordingFaults {
    const at = this.handle.prepared(CS_RECORDING_FAULTS_VERSION);
    this.core.exports.cs_recording_get_faults(this.pointer, at);
    const view = this.core.view();
    return {
      frames: Number(view.getBigUint64(at + cs_recording_faults.frames, true)),
      undecodable: Number(view.getBigUint64(at + cs_recording_faults.undecodable, true)),
      different: Number(view.getBigUint64(at + cs_recording_faults.different, true)),
      firstTick: view.getBigUint64(at + cs_recording_faults.first_tick, true),
      firstSeconds: view.getFloat64(at + cs_recording_faults.first_seconds, true),
    };
  }

  // Entry of the metadata, such as "server" or "scene" (docs/recording.md); "" without one.
  metadata(name: string): string {
    return this.core.with([name], (text) => this.core.text(this.core.exports.cs_recording_metadata(this.pointer, text!)));
  }

  // Continues to the next message of these kinds; undefined at the end. Throws for a damaged chunk, and for a frame that
  // cannot be decoded or differs from its recorded hash; the next call continues after it. The frames that depend on
  // such a frame are left out without a further error; `faults` counts them.
  next(kinds: number = Recorded.frame): RecordedMessage | undefined {
    const out = this.handle.prepared(CS_RECORDED_VERSION);
    const result = this.core.exports.cs_recording_next(this.pointer, kinds, out);
    if (result < 0) throw this.error();
    return result === 0 ? undefined : this.message(out);
  }

  // Goes to the newest frame at or before a time, in seconds since the start; undefined without such a
  // frame. Throws if it cannot be read, or if a frame between it and its key frame has a fault.
  seek(seconds: number): RecordedMessage | undefined {
    const out = this.handle.prepared(CS_RECORDED_VERSION);
    if (this.core.exports.cs_recording_seek(this.pointer, seconds, out) === 0) throw this.error();
    return this.message(out);
  }

  // Like seek(), to the newest frame with this tick or an earlier one.
  seekTick(tick: bigint): RecordedMessage | undefined {
    const out = this.handle.prepared(CS_RECORDED_VERSION);
    if (this.core.exports.cs_recording_seek_tick(this.pointer, tick, out) === 0) throw this.error();
    return this.message(out);
  }

  // Hash of the newest decoded frame.
  get hash(): bigint {
    return BigInt.asUintN(64, this.core.exports.cs_reconstruction_hash(this.handle.pointer));
  }

  // Events of grabs in the newest message of the kind events.
  grabEvents(): (GrabEvent & { participant: bigint })[] {
    return readGrabEvents(this.handle);
  }

  // Text of the newest notice; "" before the first.
  get notice(): string {
    return this.core.text(this.core.exports.cs_notice_text(this.handle.pointer));
  }

  // The newest message as in the file: serialised protobuf. Empty before the first and after a seek.
  bytes(): Uint8Array {
    const at = this.core.exports.cs_recording_message(this.pointer, this.handle.scratch);
    return this.core.bytes(at, this.core.view().getUint32(this.handle.scratch, true)).slice();
  }

  // The newest tick of the journal; undefined before the first.
  tick(): RecordedTick | undefined {
    const at = this.handle.prepared(CS_RECORDED_TICK_VERSION);
    const { exports } = this.core;
    if (exports.cs_recording_get_tick(this.pointer, at) === 0) return undefined;
    const view = this.core.view();
    const counts = [cs_recorded_tick.collider_count, cs_recorded_tick.attachment_count, cs_recorded_tick.grab_count];
    const [colliders, attachments, grabs] = counts.map((offset) => view.getUint32(at + offset, true));
    const tick = {
      tick: view.getBigUint64(at + cs_recorded_tick.tick, true),
      stateHash: view.getBigUint64(at + cs_recorded_tick.state_hash, true),
      recovery: view.getUint32(at + cs_recorded_tick.recovery, true),
      unhealthy: view.getInt32(at + cs_recorded_tick.unhealthy, true) !== 0,
      savesState: view.getInt32(at + cs_recorded_tick.saves_state, true) !== 0,
      gravity: vec3(view, at + cs_recorded_tick.gravity),
      wind: vec3(view, at + cs_recorded_tick.wind),
      airDensity: view.getFloat32(at + cs_recorded_tick.air_density, true),
      substeps: view.getUint32(at + cs_recorded_tick.substeps, true),
    };
    return {
      ...tick,
      colliders: this.list(colliders!, this.handle.prepared(CS_RECORDED_COLLIDER_VERSION), exports.cs_recording_get_collider, readCollider),
      attachments: this.list(attachments!, this.handle.scratch, exports.cs_recording_get_attachment, readPose),
      grabs: this.list(grabs!, this.handle.prepared(CS_RECORDED_GRAB_VERSION), exports.cs_recording_get_grab, readGrab),
    };
  }

  // The newest checkpoint of the journal; undefined before the first.
  state(): RecordedState | undefined {
    const { scratch } = this.handle;
    const tickAt = scratch + 8;
    const nodes = this.core.exports.cs_recording_state(this.pointer, scratch, tickAt);
    if (nodes === 0) return undefined;
    const view = this.core.view();
    return { tick: view.getBigUint64(tickAt, true), nodes: this.core.floats(nodes, 6 * view.getUint32(scratch, true)) };
  }

  // `get` writes a struct to `out`.
  private list<Item>(
    count: number,
    out: number,
    get: (recording: number, index: number, out: number) => number,
    read: (view: DataView, at: number) => Item,
  ): Item[] {
    const items: Item[] = [];
    for (let index = 0; index < count; ++index) {
      if (get(this.pointer, index, out) !== 0) items.push(read(this.core.view(), out));
    }
    return items;
  }

  private message(at: number): RecordedMessage | undefined {
    const view = this.core.view();
    const kind = view.getUint32(at + cs_recorded.kind, true);
    if (kind === 0) return undefined;
    return {
      kind,
      events: view.getUint32(at + cs_recorded.events, true),
      key: view.getInt32(at + cs_recorded.key, true) !== 0,
      seconds: view.getFloat64(at + cs_recorded.seconds, true),
      tick: view.getBigUint64(at + cs_recorded.tick, true),
      reconstructionHash: view.getBigUint64(at + cs_recorded.reconstruction_hash, true),
      stateHash: view.getBigUint64(at + cs_recorded.state_hash, true),
    };
  }

  private error(): Error {
    return new Error(this.core.text(this.core.exports.cs_recording_error_text(this.pointer)));
  }
}

function readPose(view: DataView, at: number): RecordedPose {
  return {
    position: vec3(view, at + cs_recorded_pose.position),
    orientation: readFloats<[number, number, number, number]>(view, at + cs_recorded_pose.orientation, [0, 0, 0, 0]),
  };
}

function readCollider(view: DataView, at: number): RecordedCollider {
  return {
    participantId: view.getBigUint64(at + cs_recorded_collider.participant_id, true),
    id: view.getUint32(at + cs_recorded_collider.id, true),
    shape: view.getUint32(at + cs_recorded_collider.shape, true),
    start: readPose(view, at + cs_recorded_collider.start),
    end: readPose(view, at + cs_recorded_collider.end),
    friction: view.getFloat32(at + cs_recorded_collider.friction, true),
    radius: view.getFloat32(at + cs_recorded_collider.radius, true),
    topRadius: view.getFloat32(at + cs_recorded_collider.top_radius, true),
    length: view.getFloat32(at + cs_recorded_collider.length, true),
    size: vec3(view, at + cs_recorded_collider.size),
  };
}

function readGrab(view: DataView, at: number): RecordedGrab {
  return {
    state: view.getUint32(at + cs_recorded_grab.state, true),
    start: readPose(view, at + cs_recorded_grab.start),
    end: readPose(view, at + cs_recorded_grab.end),
    radius: view.getFloat32(at + cs_recorded_grab.radius, true),
    reach: view.getFloat32(at + cs_recorded_grab.reach, true),
    maxForce: view.getFloat32(at + cs_recorded_grab.max_force, true),
    slipDistance: view.getFloat32(at + cs_recorded_grab.slip_distance, true),
  };
}
