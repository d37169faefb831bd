// SPDX-License-Identifier: MIT
// Loads the client core as a WebAssembly module, and reads and writes its memory.

import type { CoreFunctions, Pointer, RecordingFunctions } from "./functions";

export interface CoreExports extends CoreFunctions {
  memory: WebAssembly.Memory;
  _initialize(): void;
  malloc(bytes: number): Pointer;
  free(pointer: Pointer): void;
}

// Exports of clothstream_recording.wasm.
export interface RecordingExports extends CoreExports, RecordingFunctions {
  // Opens a source of the host (clients/recording/wasm).
  cs_recording_open_host(source: number, bytes: number, maxVertices: number): Pointer;
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

// Memory of the core that grows with what is written to it.
export class CoreBuffer<View extends Uint8Array | Float32Array> {
  private pointer: Pointer = kNull;
  private room = 0; // elements
  private readonly view: KeptView<View>;

  constructor(
    private readonly core: CoreModule,
    make: (pointer: number, count: number) => View,
  ) {
    this.view = new KeptView(core, make);
  }

  // Returns the address of the copy.
  write(values: View): number {
    if (values.length > this.room) {
      this.free();
      this.pointer = this.core.allocate(2 * values.byteLength);
      this.room = 2 * values.length;
    }
    this.view.at(this.pointer, this.room).set(values);
    return this.pointer;
  }

  free(): void {
    this.core.exports.free(this.pointer);
    this.pointer = this.room = 0;
  }
}
