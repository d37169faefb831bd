// SPDX-License-Identifier: MIT
// Surfaces of fabrics, and vertices at texture seams.

import { assert, test } from "vitest";
import { fabricNames, fabricOf, hash, noise } from "@clothstream/three";
import { separateSeams } from "../../../clients/web/three/src/seams";
import { kThreads, weave } from "../../../clients/web/three/src/weave";

test("a material without a look is drawn like cotton", () => {
  assert.equal(fabricOf(""), fabricOf("cotton"));
  assert.equal(fabricOf("of a newer server"), fabricOf("cotton"));
  assert.equal(new Set(fabricNames().map(fabricOf)).size, fabricNames().length);
});

test("the texels of every fabric repeat without a seam, and its normals have length 1", () => {
  const size = 4 * kThreads;
  const seen = new Set<string>();
  for (const name of fabricNames()) {
    const fabric = fabricOf(name);
    const surface = weave(fabric, size);
    // Neighbours across the edge of the tile differ as neighbours inside do.
    const step = (column: number, next: number) => {
      let sum = 0;
      for (let row = 0; row < size; ++row)
        sum += Math.abs(surface.colour[4 * (row * size + column)]! - surface.colour[4 * (row * size + next)]!) / size;
      return sum;
    };
    const inside = Math.max(...Array.from({ length: size - 1 }, (_, column) => step(column, column + 1)));
    assert.isAtMost(step(size - 1, 0), 1.2 * inside + 1, name);
    let off = 0; // largest difference of a length from 1
    for (let i = 0; i < surface.relief.length; i += 4) {
      const length = Math.hypot(...[0, 1, 2].map((axis) => surface.relief[i + axis]! / 127.5 - 1));
      off = Math.max(off, Math.abs(length - 1));
    }
    assert.isBelow(off, 0.03, name);
    assert.deepEqual(weave(fabric, size), surface, `${name} is the same every time`);
    seen.add(surface.colour.join(" "));
  }
  assert.equal(seen.size, fabricNames().length, "no two fabrics have the same texels");
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
