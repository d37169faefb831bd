// SPDX-License-Identifier: MIT
// One client of the core: its pointer, and memory for the structs that calls read and write.

import * as layout from "./layout";
import type { Quaternion, Spring, Vec3 } from "./types";
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

  // Calls `get` for each index, and reads the structs that it writes.
  list<Item>(
    count: number,
    get: (client: number, index: number, out: number) => number,
    read: (view: DataView, at: number, index: number) => Item,
  ): Item[] {
    const items: Item[] = [];
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

export function vec3(view: DataView, at: number): Vec3 {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true)];
}

export function quaternion(view: DataView, at: number): Quaternion {
  return [...vec3(view, at), view.getFloat32(at + 12, true)];
}

export function spring(view: DataView, at: number): Spring {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true)];
}
