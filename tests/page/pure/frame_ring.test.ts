// SPDX-License-Identifier: MIT
// The ring of frames in shared memory.

import { assert, test } from "vitest";
import { copyParts, FrameRing } from "../../../clients/web/client/src/frame_ring";

const frame = (value: number) => [Float32Array.of(value, value + 0.25), Float32Array.of(value + 0.5)];
const message = Uint8Array.of(1, 2, 3);
const decoded = (value: number) => ({ hasNormals: value % 2 === 1, hash: 2n ** 64n - 1n - BigInt(value), decodeMs: value / 4 });
const write = (ring: FrameRing, value: number) => ring.write(frame(value), message, 10 * value, decoded(value)) === "whole";

test("frames arrive whole and in order in the other thread", () => {
  const writer = new FrameRing(3);
  const reader = new FrameRing(writer.memory);
  for (let i = 0; i < 100; ++i) {
    assert.isTrue(write(writer, 2 * i));
    assert.isTrue(write(writer, 2 * i + 1));
    for (const value of [2 * i, 2 * i + 1]) {
      const slot = reader.oldest();
      assert.deepEqual([...slot.values], [value, value + 0.25, value + 0.5]);
      assert.deepEqual([...slot.message.subarray(0, slot.messageBytes)], [1, 2, 3]);
      assert.equal(slot.arrivedMs, 10 * value);
      const read = decoded(0);
      slot.read(read);
      assert.deepEqual(read, decoded(value));
      reader.take();
    }
  }
});

test("a full ring refuses frames and keeps those that it has", () => {
  const ring = new FrameRing(3);
  let written = 0;
  while (write(ring, written)) ++written;
  assert.equal(written, 16);
  assert.equal(ring.write(frame(99), message, 0, decoded(99)), "full");
  assert.equal(ring.oldest().values[0], 0);
  ring.take();
  assert.isTrue(write(ring, 16));
  for (let value = 1; value <= 16; ++value) {
    assert.equal(ring.oldest().values[0], value);
    ring.take();
  }
});

test("the counts of frames may pass 2^31 and 2^32", () => {
  for (const start of [0x7ffffff0, -16]) {
    const ring = new FrameRing(3);
    new Int32Array(ring.memory, 0, 2).fill(start);
    for (let value = 0; value < 64; ++value) {
      assert.isTrue(write(ring, value));
      assert.equal(ring.oldest().values[0], value);
      ring.take();
    }
  }
});

test("a message that does not fit is left out, and the next one is not", () => {
  const ring = new FrameRing(3);
  const { length } = ring.oldest().message;
  assert.equal(ring.write(frame(1), new Uint8Array(length + 1), 0, decoded(1)), "large");
  assert.equal(ring.oldest().messageBytes, 0);
  assert.equal(ring.oldest().values[0], 1);
  ring.take();
  assert.equal(ring.write(frame(2), new Uint8Array(length).fill(7), 0, decoded(2)), "whole");
  assert.equal(ring.oldest().messageBytes, length);
  assert.isTrue(ring.oldest().message.every((byte) => byte === 7));
  assert.equal(ring.oldest().values[0], 2);
});

test("parts are copied one after the other", () => {
  const out = new Float32Array(4);
  copyParts([Float32Array.of(1), new Float32Array(), Float32Array.of(2, 3)], out);
  assert.deepEqual([...out], [1, 2, 3, 0]);
});
