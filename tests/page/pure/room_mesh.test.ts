// SPDX-License-Identifier: MIT
// Meshes of real surfaces: polygons, scans with errors, flat parts that replace triangles, and parts of large meshes.

import * as THREE from "three";
import { assert, test } from "vitest";
import { checkedMesh, cornersOf, isSameMesh, nearestTriangles, polygonMesh, withoutFlatParts, type RoomMesh } from "@clothstream/three";

const corners = (...points: [number, number][]) => points.map(([x, z]) => new THREE.Vector2(x, z));
const kSquare = corners([-1, -1], [1, -1], [1, 1], [-1, 1]);

// Twice the signed area of the triangles seen along -y, and the least of them.
function areas({ positions, triangles }: RoomMesh): { sum: number; least: number } {
  const point = (corner: number) => new THREE.Vector3().fromArray(positions, 3 * triangles[corner]!);
  let sum = 0;
  let least = Infinity;
  for (let at = 0; at < triangles.length; at += 3) {
    const normal = point(at + 1).sub(point(at)).cross(point(at + 2).sub(point(at)));
    sum += normal.y;
    least = Math.min(least, Math.abs(normal.y));
  }
  return { sum, least };
}

test("a polygon has its front where it is asked for, whichever way round its corners are", () => {
  for (const polygon of [kSquare, [...kSquare].reverse()])
    for (const facesDown of [false, true]) {
      const mesh = polygonMesh(polygon, facesDown)!;
      assert.equal(mesh.triangles.length, 6);
      assert.equal(areas(mesh).sum, facesDown ? -8 : 8);
    }
});

test("a floor that is not convex is covered exactly once", () => {
  const floor = corners([0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]); // 4 x 1 and 1 x 2
  const { sum, least } = areas(polygonMesh(floor, false)!);
  assert.closeTo(sum, 12, 1e-6); // twice 4 + 2
  assert.isAbove(least, 0);
});

test("a loop may be closed, and corners may repeat", () => {
  const loop = [{ x: 0, z: 0 }, { x: 0, z: 0 }, { x: 1, z: 0 }, { x: 1, z: 1 }, { x: 0, z: 0 }];
  assert.deepEqual(cornersOf(loop).map(({ x, y }) => [x, y]), [[1, 0], [1, 1], [0, 0]]);
  assert.isUndefined(polygonMesh(cornersOf([{ x: 1, z: 1 }]), false));
  assert.isEmpty(cornersOf([]));
});

test("polygons without an area, with NaN, or beyond 100 m are left out", () => {
  assert.isUndefined(polygonMesh(corners([0, 0], [1, 0]), false));
  assert.isUndefined(polygonMesh(corners([0, 0], [1, 0], [2, 0]), false));
  assert.isUndefined(polygonMesh(corners([0, 0], [1, 0], [0.5, NaN]), false));
  assert.isUndefined(polygonMesh(corners([0, 0], [Infinity, 0], [0, 1]), false));
  assert.isUndefined(polygonMesh(corners([0, 0], [101, 0], [0, 1]), false));
  assert.isDefined(polygonMesh(corners([0, 0], [100, 0], [0, 1]), false));
});

test("a scan keeps the triangles that are usable", () => {
  const vertices = [0, 0, 0, 1, 0, 0, 0, 0, 1, NaN, 0, 0, 0, 1e9, 0, 2, 0, 0];
  // Usable; same corner twice; no such vertex; NaN; too far away; usable; incomplete.
  const indices = [0, 2, 1, 0, 0, 1, 0, 1, 6, 0, 1, 3, 4, 0, 1, 1, 2, 5, 0, 1];
  const mesh = checkedMesh(vertices, indices)!;
  assert.deepEqual([...mesh.positions], [0, 0, 0, 0, 0, 1, 1, 0, 0, 2, 0, 0]);
  assert.deepEqual([...mesh.triangles], [0, 1, 2, 2, 1, 3]);
  assert.isUndefined(checkedMesh(vertices, [0, 1, 3]));
  assert.isUndefined(checkedMesh([], []));
});

// A scan of a square table whose top goes up and down by 3 cm, and a wall.
function scannedTable(): RoomMesh {
  const vertices: number[] = [];
  for (let row = 0; row <= 10; ++row)
    for (let column = 0; column <= 10; ++column) vertices.push(column / 5 - 1, 0.75 + ((row + column) % 2 ? 0.03 : -0.03), row / 5 - 1);
  const triangles: number[] = [];
  for (let row = 0; row < 10; ++row)
    for (let column = 0; column < 10; ++column) {
      const at = 11 * row + column;
      triangles.push(at, at + 11, at + 1, at + 1, at + 11, at + 12);
    }
  const wall = vertices.length / 3;
  vertices.push(0, 0.73, 0, 0, 0.77, 0, 0, 0.75, 0.04);
  triangles.push(wall, wall + 1, wall + 2);
  return checkedMesh(vertices, triangles)!;
}

test("a flat part replaces the rough triangles of a scan, but not those that stand on it", () => {
  const table = { corners: kSquare, fromRoom: new THREE.Matrix4().makeTranslation(0, -0.75, 0) };
  const left = withoutFlatParts(scannedTable(), new THREE.Matrix4(), [table])!;
  assert.equal(left.triangles.length, 3);
  assert.equal(left.positions.length, 9);
  // The scan is elsewhere: nothing is replaced.
  const scan = scannedTable();
  assert.strictEqual(withoutFlatParts(scan, new THREE.Matrix4().makeTranslation(0, 0.1, 0), [table]), scan);
  assert.strictEqual(withoutFlatParts(scan, new THREE.Matrix4(), []), scan);
  // Half of the table has a flat part, with a margin of 5 cm.
  const half = { ...table, corners: corners([-1, -1], [0, -1], [0, 1], [-1, 1]) };
  assert.equal(withoutFlatParts(scan, new THREE.Matrix4(), [half])!.triangles.length / 3, 101);
});

test("of a large mesh, the triangles that are nearest to the scene are sent", () => {
  const mesh = scannedTable();
  const part = nearestTriangles(mesh, new THREE.Vector3(-1, 0.75, -1), 20)!;
  assert.equal(part.triangles.length, 60);
  for (let at = 0; at < part.positions.length; at += 3) {
    assert.isBelow(part.positions[at]!, 0.21);
    assert.isBelow(part.positions[at + 2]!, 0.21);
  }
  assert.isTrue(isSameMesh(part, nearestTriangles(mesh, new THREE.Vector3(-1, 0.75, -1), 20)!));
  assert.strictEqual(nearestTriangles(mesh, new THREE.Vector3(), 1000), mesh);
  assert.isUndefined(nearestTriangles(mesh, new THREE.Vector3(), 0));
});
