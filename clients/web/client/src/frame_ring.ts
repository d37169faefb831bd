// SPDX-License-Identifier: MIT
// Ring of decoded frames in memory that two threads share: one writes, one reads. A frame comes with the message that
// brought it, so that the reader needs no other object for it.

import type { DecodedFrame } from "./client";

// At 72 frames per second the reader may be busy for 0.2 s before frames are skipped.
const kSlots = 16;
const kHeaderBytes = 16;
const kWritten = 0; // number of frames written
const kTaken = 1; // number of frames taken
const kFloats = 2; // floats of a frame
// A message has compressed values, and colliders. A larger one is posted instead.
const kLeastMessageRoom = 4096; // bytes, and one more for each float

// A slot begins with four numbers and a hash; message and values follow.
const kHashAt = 32;
const kMessageAt = 40;

// A frame in the ring.
class Slot {
  readonly values: Float32Array;
  readonly message: Uint8Array; // as much as the message may need
  private readonly numbers: Float64Array;
  private readonly hash: BigUint64Array;

  constructor(memory: SharedArrayBuffer, at: number, floats: number) {
    this.numbers = new Float64Array(memory, at, 4);
    this.hash = new BigUint64Array(memory, at + kHashAt, 1);
    this.message = new Uint8Array(memory, at + kMessageAt, messageRoom(floats));
    this.values = new Float32Array(memory, at + kMessageAt + messageRoom(floats), floats);
  }

  static bytes(floats: number): number {
    return kMessageAt + messageRoom(floats) + 8 * Math.ceil(floats / 2);
  }

  // Size of the message; 0 if it is posted.
  get messageBytes(): number {
    return this.numbers[0]!;
  }
  get arrivedMs(): number {
    return this.numbers[1]!;
  }

  // Copies what is known of the frame to `out`.
  read(out: DecodedFrame): void {
    out.decodeMs = this.numbers[2]!;
    out.hasNormals = this.numbers[3] !== 0;
    out.hash = this.hash[0]!;
  }

  write(parts: readonly Float32Array[], message: Uint8Array, arrivedMs: number, frame: DecodedFrame): void {
    copyParts(parts, this.values);
    const fits = message.length <= this.message.length;
    if (fits) this.message.set(message);
    this.numbers[0] = fits ? message.length : 0;
    this.numbers[1] = arrivedMs;
    this.numbers[2] = frame.decodeMs;
    this.numbers[3] = frame.hasNormals ? 1 : 0;
    this.hash[0] = frame.hash;
  }
}

export class FrameRing {
  readonly memory: SharedArrayBuffer;
  private readonly counts: Int32Array;
  private readonly slots: Slot[];

  // Creates a ring for frames of this many floats, or opens the ring of the other thread.
  constructor(floats: number);
  constructor(memory: SharedArrayBuffer);
  constructor(from: number | SharedArrayBuffer) {
    this.memory = typeof from === "number" ? new SharedArrayBuffer(kHeaderBytes + kSlots * Slot.bytes(from)) : from;
    this.counts = new Int32Array(this.memory, 0, 3);
    if (typeof from === "number") this.counts[kFloats] = from;
    const floats = this.counts[kFloats]!;
    this.slots = Array.from({ length: kSlots }, (_, slot) => new Slot(this.memory, kHeaderBytes + slot * Slot.bytes(floats), floats));
  }

  // Copies a frame and its message to the next slot. Returns "full" if the reader has not taken any of the frames in the
  // ring, and "large" if the message does not fit, but the frame does.
  write(parts: readonly Float32Array[], message: Uint8Array, arrivedMs: number, frame: DecodedFrame): "whole" | "large" | "full" {
    const written = Atomics.load(this.counts, kWritten);
    if (((written - Atomics.load(this.counts, kTaken)) | 0) >= kSlots) return "full";
    const slot = this.slots[(written >>> 0) % kSlots]!;
    slot.write(parts, message, arrivedMs, frame);
    Atomics.store(this.counts, kWritten, (written + 1) | 0);
    return slot.messageBytes > 0 ? "whole" : "large";
  }

  // The oldest frame that is not taken. Call take() after its use.
  oldest(): Slot {
    return this.slots[(Atomics.load(this.counts, kTaken) >>> 0) % kSlots]!;
  }
  take(): void {
    Atomics.add(this.counts, kTaken, 1);
  }
}

function messageRoom(floats: number): number {
  return kLeastMessageRoom + 8 * Math.ceil(floats / 8);
}

// Copies arrays to `out`, one after the other.
export function copyParts(parts: readonly Float32Array[], out: Float32Array): void {
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
}
