// SPDX-License-Identifier: MIT
// Surfaces of fabrics, and vertices at texture seams.

import { assert, test } from "vitest";
import { fabricNames, fabricOf, hash, noise } from "@clothstream/three";
import { separateSeams } from "../../../clients/web/three/src/seams";
import { weave, type Pattern } from "../../../clients/web/three/src/weave";

test("a material without a look is drawn like cotton", () => {
  assert.equal(fabricOf(""), fabricOf("cotton"));
  assert.equal(fabricOf("of a newer server"), fabricOf("cotton"));
  assert.equal(new Set(fabricNames().map(fabricOf)).size, fabricNames().length);
});

test("normals of every pattern have length 1 and point outwards, and its colours vary", () => {
  const patterns: Pattern[] = ["plain", "twill", "satin", "ripstop", "grain", "fibres", "stipple"];
  const size = 80;
  for (const pattern of patterns) {
    const { colour, relief, roughness } = weave({ pattern, weft: 0.9, variation: 0.1 }, size);
    for (let texel = 0; texel < relief.length; texel += 4) {
      const [x, y, z] = [...relief.subarray(texel, texel + 3)].map((value) => value / 127.5 - 1) as [number, number, number];
      assert.closeTo(Math.hypot(x, y, z), 1, 0.03, pattern);
      assert.isAbove(z, 0, pattern);
      assert.isAbove(roughness[texel + 1]!, 127, pattern);
    }
    assert.isAbove(new Set(colour).size, 5, pattern);
  }
});

test("the same threads give the same texels", () => {
  const threads = { pattern: "twill", weft: 1.9, variation: 0.26 } as const;
  assert.deepEqual(weave(threads, 40), weave(threads, 40));
});

test("noise repeats without a step after its number of cells", () => {
  for (let i = 0; i < 50; ++i) {
    const [x, y] = [0.37 * i, 0.61 * i];
    const value = noise(x, y, 7, 5);
    assert.isTrue(value >= 0 && value < 1);
    assert.closeTo(noise(x + 7, y, 7, 5), value, 1e-9);
    assert.closeTo(noise(x, y - 5, 7, 5), value, 1e-9);
    assert.closeTo(noise(x + 1e-7, y, 7, 5), value, 1e-5);
  }
});

test("hashes are spread evenly over 0 to 1", () => {
  const counts = new Array<number>(10).fill(0);
  for (let x = 0; x < 100; ++x) for (let y = 0; y < 100; ++y) ++counts[Math.floor(10 * hash(x, y))]!;
  for (const count of counts) assert.closeTo(count, 1000, 150);
});

test("only vertices with several texture coordinates are duplicated", () => {
  // Two triangles on one edge. Vertex 1 has the coordinates 1 and 5 there, vertex 2 has 2 in both.
  const drawn = separateSeams(4, Uint32Array.of(0, 1, 2, 2, 1, 3), Uint32Array.of(0, 1, 2, 2, 5, 3));
  assert.equal(drawn.count, 5);
  assert.deepEqual([...drawn.indices], [0, 1, 2, 2, 4, 3]);
  assert.deepEqual([...drawn.copies], [1]);
  assert.deepEqual([...drawn.uvs], [0, 1, 2, 3, 5]);
});

test("a seam between many triangles makes one copy for each coordinate", () => {
  const drawn = separateSeams(3, Uint32Array.of(0, 1, 2, 0, 1, 2, 0, 1, 2), Uint32Array.of(0, 1, 2, 3, 1, 2, 3, 1, 2));
  assert.deepEqual([...drawn.copies], [0]);
  assert.deepEqual([...drawn.indices], [0, 1, 2, 3, 1, 2, 3, 1, 2]);
});

test("a mesh without texture coordinates stays as it is, with unused vertices", () => {
  const drawn = separateSeams(5, Uint32Array.of(0, 1, 2), new Uint32Array());
  assert.equal(drawn.count, 5);
  assert.deepEqual([...drawn.indices], [0, 1, 2]);
  assert.deepEqual([...drawn.uvs], [0, 0, 0, 0, 0]);
});
