// SPDX-License-Identifier: MIT
// Loads the client core as a WebAssembly module, and reads and writes its memory.

type Pointer = number;

// Functions of clients/core/core.h with WebAssembly types: size_t and pointers are numbers, uint64_t is bigint.
export interface CoreExports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  malloc(bytes: number): Pointer;
  free(pointer: Pointer): void;
  cs_create_as(scene: Pointer, clientName: Pointer, displayName: Pointer, role: number): Pointer;
  cs_set_token(client: Pointer, token: Pointer): void;
  cs_set_pairing_code(client: Pointer, code: Pointer): void;
  cs_renew_token(client: Pointer, token: Pointer): number;
  cs_token(client: Pointer): Pointer;
  cs_set_resume_token(client: Pointer, token: Pointer): number;
  cs_resume_token(client: Pointer): Pointer;
  cs_create_pairing_code(client: Pointer, role: number): void;
  cs_get_pairing_code(client: Pointer, out: Pointer): number;
  cs_error_code(client: Pointer): number;
  cs_connecting(client: Pointer, nowUs: bigint): void;
  cs_disconnected(client: Pointer, nowUs: bigint): void;
  cs_connect_at(client: Pointer): bigint;
  cs_follow_redirects(client: Pointer, on: number): void;
  cs_connect_server(client: Pointer): Pointer;
  cs_next_server(client: Pointer): Pointer;
  cs_participant_count(client: Pointer): number;
  cs_get_participant(client: Pointer, index: number, out: Pointer): number;
  cs_create_mirror(scene: Pointer, clientName: Pointer, displayName: Pointer, role: number): Pointer;
  cs_receive_decoded(mirror: Pointer, message: Pointer, bytes: number, decoded: Pointer, nowUs: bigint): number;
  cs_sends_normals(client: Pointer): number;
  cs_reconstruction_hash(client: Pointer): bigint;
  cs_want(client: Pointer, quality: number): void;
  cs_get_role(client: Pointer): number;
  cs_set_role(client: Pointer, participant: bigint, role: number): void;
  cs_remove_participant(client: Pointer, participant: bigint): void;
  cs_ban_participant(client: Pointer, participant: bigint): void;
  cs_get_stage_statistics(client: Pointer, out: Pointer): number;
  cs_set_local_contact(client: Pointer, on: number): void;
  cs_local_correction(client: Pointer): number;
  cs_nearest_point(client: Pointer, point3: Pointer, maxDistance: number, out: Pointer): number;
  cs_set_shapes(client: Pointer, colliders: Pointer, count: number, nowUs: bigint): void;
  cs_set_head(client: Pointer, position3: Pointer, orientation4: Pointer, radius: number, nowUs: bigint): void;
  cs_set_hand(client: Pointer, side: number, joints: Pointer, count: number, nowUs: bigint): number;
  cs_move_joints(client: Pointer, collider: Pointer, poses: Pointer, count: number, nowUs: bigint): void;
  cs_destroy(client: Pointer): void;
  cs_receive(client: Pointer, message: Pointer, bytes: number, nowUs: bigint): number;
  cs_update(client: Pointer, nowUs: bigint): void;
  cs_next_outgoing(client: Pointer, bytes: Pointer): Pointer;
  cs_get_state(client: Pointer): number;
  cs_error_text(client: Pointer): Pointer;
  cs_notice_text(client: Pointer): Pointer;
  cs_get_statistics(client: Pointer, nowUs: bigint, out: Pointer): void;
  cs_server_name(client: Pointer): Pointer;
  cs_device_name(client: Pointer): Pointer;
  cs_scene_name(client: Pointer): Pointer;
  cs_stream_rate(client: Pointer): number;
  cs_frame_divisor(client: Pointer): number;
  cs_vertex_count(client: Pointer): number;
  cs_positions(client: Pointer): Pointer;
  cs_normals(client: Pointer): Pointer;
  cs_default_play_out(out: Pointer): void;
  cs_set_play_out(client: Pointer, options: Pointer): number;
  cs_play_out(client: Pointer, nowUs: bigint, displayUs: bigint, out: Pointer): number;
  cs_played_positions(client: Pointer): Pointer;
  cs_played_normals(client: Pointer): Pointer;
  cs_played_collider_count(client: Pointer): number;
  cs_get_played_collider(client: Pointer, index: number, out: Pointer): number;
  cs_triangles(client: Pointer, indexCount: Pointer): Pointer;
  cs_cloth_count(client: Pointer): number;
  cs_get_cloth(client: Pointer, index: number, out: Pointer): number;
  cs_uvs(client: Pointer, cloth: number, count: Pointer): Pointer;
  cs_uv_indices(client: Pointer, cloth: number, count: Pointer): Pointer;
  cs_submesh_count(client: Pointer, cloth: number): number;
  cs_get_submesh(client: Pointer, cloth: number, index: number, out: Pointer): number;
  cs_collider_count(client: Pointer): number;
  cs_get_collider(client: Pointer, index: number, out: Pointer): number;
  cs_get_hull(client: Pointer, index: number, vertexCount: Pointer, triangles: Pointer, indexCount: Pointer): Pointer;
  cs_get_environment(client: Pointer, out: Pointer): number;
  cs_get_cloth_parameters(client: Pointer, index: number, out: Pointer): number;
  cs_get_cloth_settings(client: Pointer, index: number, out: Pointer): number;
  cs_get_cloth_report(client: Pointer, index: number, out: Pointer): number;
  cs_want_constraints(client: Pointer, wants: number, nowUs: bigint): void;
  cs_constraint_ends(client: Pointer, index: number, count: Pointer): Pointer;
  cs_keep_cloth_settings(out: Pointer): void;
  cs_change_cloth(client: Pointer, cloth: Pointer, settings: Pointer): number;
  cs_participant_id(client: Pointer): bigint;
  cs_grab_event_count(client: Pointer): number;
  cs_get_grab_event(client: Pointer, index: number, out: Pointer): number;
  cs_cast_ray(client: Pointer, origin3: Pointer, direction3: Pointer, maxDistance: number, out: Pointer): number;
  cs_set_grabs(client: Pointer, grabs: Pointer, count: number, nowUs: bigint): void;
  cs_set_environment(client: Pointer, gravity3: Pointer, wind3: Pointer, airDensity: Pointer): void;
  cs_set_gust(client: Pointer, strength: number, seconds: number): void;
  cs_set_material(client: Pointer, cloth: Pointer, material: Pointer): void;
  cs_material_count(client: Pointer): number;
  cs_material(client: Pointer, index: number): Pointer;
  cs_cloth_material(client: Pointer, cloth: number): Pointer;
  cs_set_cloth(client: Pointer, cloth: Pointer, structural2: Pointer, shear2: Pointer, bend2: Pointer, damping: Pointer): void;
  cs_keep_collider(out: Pointer): void;
  cs_change_collider(client: Pointer, collider: Pointer, change: Pointer): number;
  cs_set_areal_mass(client: Pointer, cloth: Pointer, arealMass: number): void;
  cs_get_playback(client: Pointer, nowUs: bigint, out: Pointer): number;
  cs_pause(client: Pointer, paused: number): void;
  cs_seek(client: Pointer, seconds: number): void;
  cs_set_speed(client: Pointer, speed: number): void;
  cs_set_loop(client: Pointer, loop: number): void;
  cs_list_scenes(client: Pointer): void;
  cs_scene_count(client: Pointer): number;
  cs_scene(client: Pointer, index: number): Pointer;
  cs_get_scene(client: Pointer, index: number, out: Pointer): number;
  cs_get_answer(client: Pointer, out: Pointer): number;
  cs_create_scene(client: Pointer, scene: Pointer, bytes: number, name: Pointer, maxParticipants: number): bigint;
  cs_copy_scene(client: Pointer, source: Pointer, name: Pointer, maxParticipants: number): bigint;
  cs_get_upload(client: Pointer, sentBytes: Pointer, bytes: Pointer): number;
  cs_delete_scene(client: Pointer, scene: Pointer): bigint;
  cs_reset_scene(client: Pointer, scene: Pointer): bigint;
  cs_pause_scene(client: Pointer, scene: Pointer, paused: number): bigint;
  cs_start_recording(client: Pointer, scene: Pointer, file: Pointer): bigint;
  cs_stop_recording(client: Pointer, scene: Pointer): bigint;
  cs_list_bans(client: Pointer, scene: Pointer): bigint;
  cs_lift_ban(client: Pointer, scene: Pointer, subject: Pointer): bigint;
  cs_ban_count(client: Pointer): number;
  cs_get_ban(client: Pointer, index: number, out: Pointer): number;
}

// Functions of clients/recording/recording.h, which only clothstream_recording.wasm has.
export interface RecordingExports extends CoreExports {
  cs_recording_open_host(source: number, bytes: number, maxVertices: number): Pointer;
  cs_recording_close(recording: Pointer): void;
  cs_recording_is_open(recording: Pointer): number;
  cs_recording_error_text(recording: Pointer): Pointer;
  cs_recording_client(recording: Pointer): Pointer;
  cs_recording_get_info(recording: Pointer, out: Pointer): number;
  cs_recording_metadata(recording: Pointer, name: Pointer): Pointer;
  cs_recording_next(recording: Pointer, kinds: number, out: Pointer): number;
  cs_recording_seek(recording: Pointer, seconds: number, out: Pointer): number;
  cs_recording_seek_tick(recording: Pointer, tick: bigint, out: Pointer): number;
  cs_recording_get_faults(recording: Pointer, out: Pointer): number;
  cs_recording_message(recording: Pointer, bytes: Pointer): Pointer;
  cs_recording_get_tick(recording: Pointer, out: Pointer): number;
  cs_recording_get_collider(recording: Pointer, index: number, out: Pointer): number;
  cs_recording_get_attachment(recording: Pointer, index: number, out: Pointer): number;
  cs_recording_get_grab(recording: Pointer, index: number, out: Pointer): number;
  cs_recording_state(recording: Pointer, nodeCount: Pointer, tick: Pointer): Pointer;
}

const kNull: Pointer = 0;

// Any call may grow the memory, which detaches every view. Get a new view for each access.
export class CoreModule<Exports extends CoreExports = CoreExports> {
  private readonly decoder = new TextDecoder();
  private readonly encoder = new TextEncoder();

  private data: DataView;

  private constructor(readonly exports: Exports) {
    this.data = new DataView(exports.memory.buffer);
  }

  // Compiles the module, which several threads may then start.
  static async compile(url: string | URL): Promise<WebAssembly.Module> {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url} could not be loaded: ${response.status} ${response.statusText}`);
    return WebAssembly.compile(await response.arrayBuffer()).catch((cause: unknown) => {
      // A server that answers every address with its page does this.
      throw new Error(`${url} is not a WebAssembly module. Vite's development server needs optimizeDeps.exclude: ["@clothstream/client"]`, { cause });
    });
  }

  static async start(module: WebAssembly.Module): Promise<CoreModule> {
    return CoreModule.startWith<CoreExports>(module, {});
  }

  // Starts a module that imports functions.
  static async startWith<Exports extends CoreExports>(module: WebAssembly.Module, imports: WebAssembly.Imports): Promise<CoreModule<Exports>> {
    const instance = await WebAssembly.instantiate(module, imports);
    const exports = instance.exports as unknown as Exports;
    exports._initialize();
    return new CoreModule(exports);
  }

  view(): DataView {
    if (this.data.buffer !== this.exports.memory.buffer) this.data = new DataView(this.exports.memory.buffer);
    return this.data;
  }

  bytes(pointer: Pointer, count: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.exports.memory.buffer, pointer, count);
  }

  floats(pointer: Pointer, count: number): Float32Array {
    return new Float32Array(this.exports.memory.buffer, pointer, count);
  }

  indices(pointer: Pointer, count: number): Uint32Array {
    return new Uint32Array(this.exports.memory.buffer, pointer, count);
  }

  // Reads a zero-terminated string. Returns "" for a null pointer.
  text(pointer: Pointer): string {
    if (pointer === kNull) return "";
    const memory = new Uint8Array(this.exports.memory.buffer, pointer);
    return this.decoder.decode(memory.subarray(0, memory.indexOf(0)));
  }

  // Whether a zero-terminated string is `text`. May return false for text that is not ASCII.
  holds(pointer: Pointer, text: string): boolean {
    const view = this.view();
    for (let i = 0; i < text.length; ++i) if (view.getUint8(pointer + i) !== text.charCodeAt(i)) return false;
    return view.getUint8(pointer + text.length) === 0;
  }

  allocate(bytes: number): Pointer {
    const pointer = this.exports.malloc(bytes);
    if (pointer === kNull) throw new Error(`The client core is out of memory (${bytes} bytes requested)`);
    return pointer;
  }

  // Calls `use` with pointers to copies of the values; undefined becomes null. The copies are freed when it returns.
  with<Result>(values: (string | readonly number[] | undefined)[], use: (...pointers: Pointer[]) => Result): Result {
    const pointers = values.map((value) => {
      if (value === undefined) return kNull;
      if (typeof value === "string") {
        const text = this.encoder.encode(value + "\0");
        const pointer = this.allocate(text.length);
        this.bytes(pointer, text.length).set(text);
        return pointer;
      }
      const pointer = this.allocate(4 * value.length);
      this.floats(pointer, value.length).set(value);
      return pointer;
    });
    try {
      return use(...pointers);
    } finally {
      for (const pointer of pointers) this.exports.free(pointer);
    }
  }
}

// View of the core's memory that is used again while the memory, the place and the size stay the same, so that frames
// allocate none.
export class KeptView<View extends Uint8Array | Float32Array> {
  private view: View | undefined;

  constructor(
    private readonly core: CoreModule,
    private readonly make: (pointer: Pointer, count: number) => View,
  ) {}

  at(pointer: Pointer, count: number): View {
    const { view } = this;
    // A view of memory that has grown has another buffer.
    if (view?.buffer === this.core.exports.memory.buffer && view.byteOffset === pointer && view.length === count) return view;
    return (this.view = this.make(pointer, count));
  }
}
