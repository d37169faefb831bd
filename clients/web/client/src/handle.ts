// SPDX-License-Identifier: MIT
// One client of the core: its pointer, and memory for the structs that calls read and write.

import * as layout from "./layout";
import type { Spring } from "./types";
import type { CoreModule } from "./wasm";

// Enough for each struct of core.h.
const kScratchBytes = Math.max(...Object.values(layout).map((struct) => (typeof struct === "number" ? 0 : struct.sizeof)));

export class CoreHandle {
  readonly scratch: number;

  constructor(
    readonly core: CoreModule,
    readonly pointer: number,
  ) {
    this.scratch = core.allocate(kScratchBytes);
  }

  // Prepares the scratch memory for a struct of this version, and returns it.
  prepared(version: number): number {
    this.core.view().setUint32(this.scratch, version, true); // the first member of each struct
    return this.scratch;
  }

  // Calls `get` for each index, and reads the structs of this version that it writes.
  list<Item>(
    count: number,
    version: number,
    get: (client: number, index: number, out: number) => number,
    read: (view: DataView, at: number, index: number) => Item,
  ): Item[] {
    const items: Item[] = [];
    this.prepared(version);
    for (let index = 0; index < count; ++index) {
      if (get(this.pointer, index, this.scratch) !== 0) items.push(read(this.core.view(), this.scratch, index));
    }
    return items;
  }

  destroy(): void {
    this.core.exports.cs_destroy(this.pointer);
    this.core.exports.free(this.scratch);
  }
}

// Times of the core are microseconds of performance.now().
export function nowUs(): bigint {
  return microseconds(performance.now());
}

export function microseconds(milliseconds: number): bigint {
  return BigInt(Math.round(1000 * milliseconds));
}

// Overwrites all elements of `out`, and returns it.
export function readFloats<Numbers extends number[]>(view: DataView, at: number, out: Numbers): Numbers {
  for (let i = 0; i < out.length; ++i) out[i] = view.getFloat32(at + 4 * i, true);
  return out;
}

export function writeFloats(view: DataView, at: number, values: readonly number[]): void {
  for (let i = 0; i < values.length; ++i) view.setFloat32(at + 4 * i, values[i]!, true);
}

export function vec3(view: DataView, at: number): [number, number, number] {
  return readFloats(view, at, [0, 0, 0]);
}

export function spring(view: DataView, at: number): Spring {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true)];
}
