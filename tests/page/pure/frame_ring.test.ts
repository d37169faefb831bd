// SPDX-License-Identifier: MIT
// The ring of frames in shared memory.

import { assert, test } from "vitest";
import { copyParts, FrameRing } from "../../../clients/web/client/src/frame_ring";

const frame = (value: number) => [Float32Array.of(value, value + 0.25), Float32Array.of(value + 0.5)];

test("frames arrive whole and in order in the other thread", () => {
  const writer = new FrameRing(3);
  const reader = new FrameRing(writer.memory);
  for (let i = 0; i < 100; ++i) {
    assert.isTrue(writer.write(frame(2 * i)));
    assert.isTrue(writer.write(frame(2 * i + 1)));
    for (const value of [2 * i, 2 * i + 1]) {
      assert.deepEqual([...reader.oldest()], [value, value + 0.25, value + 0.5]);
      reader.take();
    }
  }
});

test("a full ring refuses frames and keeps those that it has", () => {
  const ring = new FrameRing(3);
  let written = 0;
  while (ring.write(frame(written))) ++written;
  assert.equal(written, 16);
  assert.isFalse(ring.write(frame(99)));
  assert.equal(ring.oldest()[0], 0);
  ring.take();
  assert.isTrue(ring.write(frame(16)));
  for (let value = 1; value <= 16; ++value) {
    assert.equal(ring.oldest()[0], value);
    ring.take();
  }
});

test("the counts of frames may pass 2^31 and 2^32", () => {
  for (const start of [0x7ffffff0, -16]) {
    const ring = new FrameRing(3);
    new Int32Array(ring.memory, 0, 2).fill(start);
    for (let value = 0; value < 64; ++value) {
      assert.isTrue(ring.write(frame(value)));
      assert.equal(ring.oldest()[0], value);
      ring.take();
    }
  }
});

test("parts are copied one after the other", () => {
  const out = new Float32Array(4);
  copyParts([Float32Array.of(1), new Float32Array(), Float32Array.of(2, 3)], out);
  assert.deepEqual([...out], [1, 2, 3, 0]);
});
