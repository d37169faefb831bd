// SPDX-License-Identifier: MIT
// Ring of decoded frames in memory that two threads share: one writes, one reads.

// At 72 frames per second the reader may be busy for 0.2 s before frames are skipped.
const kSlots = 16;
const kHeaderBytes = 8; // number of frames written, and number taken
const kWritten = 0;
const kTaken = 1;

export class FrameRing {
  readonly memory: SharedArrayBuffer;
  private readonly counts: Int32Array;
  private readonly slots: Float32Array[];

  // Creates a ring for frames of this many floats, or opens the ring of the other thread.
  constructor(floats: number);
  constructor(memory: SharedArrayBuffer);
  constructor(from: number | SharedArrayBuffer) {
    this.memory = typeof from === "number" ? new SharedArrayBuffer(kHeaderBytes + kSlots * from * 4) : from;
    this.counts = new Int32Array(this.memory, 0, 2);
    const floats = (this.memory.byteLength - kHeaderBytes) / (4 * kSlots);
    this.slots = Array.from({ length: kSlots }, (_, slot) => new Float32Array(this.memory, kHeaderBytes + 4 * floats * slot, floats));
  }

  // Copies a frame to the next slot. Returns false if the reader has not taken any of the frames in the ring.
  write(parts: readonly Float32Array[]): boolean {
    const written = Atomics.load(this.counts, kWritten);
    if (((written - Atomics.load(this.counts, kTaken)) | 0) >= kSlots) return false;
    copyParts(parts, this.slots[(written >>> 0) % kSlots]!);
    Atomics.store(this.counts, kWritten, (written + 1) | 0);
    return true;
  }

  // The oldest frame that is not taken. Call take() after its use.
  oldest(): Float32Array {
    return this.slots[(Atomics.load(this.counts, kTaken) >>> 0) % kSlots]!;
  }
  take(): void {
    Atomics.add(this.counts, kTaken, 1);
  }
}

// Copies arrays to `out`, one after the other.
export function copyParts(parts: readonly Float32Array[], out: Float32Array): void {
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
}
