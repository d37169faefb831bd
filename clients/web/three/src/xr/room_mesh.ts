// SPDX-License-Identifier: MIT
// Meshes of real surfaces: made from what a headset detects, checked, and reduced.

import * as THREE from "three";

export interface RoomMesh {
  positions: Float32Array; // x, y, z of each vertex, m
  triangles: Uint32Array; // three vertices of each triangle, counter-clockwise seen from the front
}

// A flat part of the room: a polygon in the plane y = 0 of a frame.
export interface FlatPart {
  corners: readonly THREE.Vector2[]; // x and z
  fromRoom: THREE.Matrix4; // from the room into that frame
}

// Largest coordinate of a vertex, m. Larger ones are errors of the device.
const kLargest = 100;
// Corners of a polygon that are nearer to each other are one, m.
const kSameCorner = 1e-4;
// Smaller polygons are left out, m^2.
const kLeastArea = 1e-4;
// A mesh that a headset has scanned goes a few centimetres up and down where the room is flat. Triangles that are so near
// to a flat part of the room, and so parallel to it, are the flat part.
const kFlatDistance = 0.04; // m
const kFlatMargin = 0.05; // m beyond its rim
const kFlatSlope = Math.cos(THREE.MathUtils.degToRad(35));

// The triangles of a polygon, with their front in the direction of y, or of -y if it faces down. Headsets say that polygons
// are convex, but those of floors of whole rooms are not. Undefined for a polygon without an area, or with a number that is
// not finite or too large.
export function polygonMesh(corners: readonly THREE.Vector2[], facesDown: boolean): RoomMesh | undefined {
  if (corners.length < 3 || corners.some(({ x, y }) => !isPlace(x) || !isPlace(y))) return undefined;
  if (Math.abs(THREE.ShapeUtils.area([...corners])) < kLeastArea) return undefined;
  const faces = THREE.ShapeUtils.triangulateShape([...corners], []);
  const triangles = new Uint32Array(3 * faces.length);
  faces.forEach((face, index) => {
    const [a, b, c] = face as [number, number, number];
    const [p, q, r] = [corners[a]!, corners[b]!, corners[c]!];
    // y of the normal: the frame is right-handed, and the corners have x and z.
    const up = (q.y - p.y) * (r.x - p.x) - (q.x - p.x) * (r.y - p.y);
    triangles.set(up > 0 === facesDown ? [a, c, b] : [a, b, c], 3 * index);
  });
  return { positions: new Float32Array(corners.flatMap(({ x, y }) => [x, 0, y])), triangles };
}

// Corners of a polygon without those that repeat the one before. Headsets may close the loop.
export function cornersOf(polygon: readonly { x: number; z: number }[]): THREE.Vector2[] {
  const corners = polygon.map(({ x, z }) => new THREE.Vector2(x, z));
  return corners.filter((corner, index) => corner.distanceTo(corners[(index + corners.length - 1) % corners.length]!) > kSameCorner || corners.length === 1);
}

// The triangles of a scanned mesh whose vertices exist, are finite and are not too far away. Undefined without any.
export function checkedMesh(vertices: ArrayLike<number>, indices: ArrayLike<number>): RoomMesh | undefined {
  const count = Math.floor(vertices.length / 3);
  const isUsable = (vertex: number) => vertex < count && isPlace(vertices[3 * vertex]!) && isPlace(vertices[3 * vertex + 1]!) && isPlace(vertices[3 * vertex + 2]!);
  const triangles: number[] = [];
  for (let at = 0; at + 2 < indices.length; at += 3) {
    const [a, b, c] = [indices[at]!, indices[at + 1]!, indices[at + 2]!];
    if (a !== b && b !== c && c !== a && isUsable(a) && isUsable(b) && isUsable(c)) triangles.push(a, b, c);
  }
  return picked(vertices, triangles);
}

// The mesh without the triangles that flat parts of the room replace. `toRoom` leads from its frame to the room. Undefined
// if nothing is left.
export function withoutFlatParts(mesh: RoomMesh, toRoom: THREE.Matrix4, flatParts: readonly FlatPart[]): RoomMesh | undefined {
  const { positions, triangles } = mesh;
  const flat = new Uint8Array(triangles.length / 3);
  const local = new Float32Array(positions.length);
  const near = new Uint8Array(positions.length / 3);
  const toPart = new THREE.Matrix4();
  const point = new THREE.Vector3();
  for (const { corners, fromRoom } of flatParts) {
    toPart.multiplyMatrices(fromRoom, toRoom);
    for (let vertex = 0; vertex < near.length; ++vertex) {
      point.fromArray(positions, 3 * vertex).applyMatrix4(toPart).toArray(local, 3 * vertex);
      near[vertex] = Math.abs(point.y) < kFlatDistance && isNearPolygon(corners, point.x, point.z) ? 1 : 0;
    }
    for (let triangle = 0; triangle < flat.length; ++triangle) {
      const [a, b, c] = [triangles[3 * triangle]!, triangles[3 * triangle + 1]!, triangles[3 * triangle + 2]!];
      if (near[a] && near[b] && near[c] && slopeOf(local, a, b, c) > kFlatSlope) flat[triangle] = 1;
    }
  }
  if (!flat.includes(1)) return mesh;
  return picked(positions, Array.from(triangles).filter((_, index) => flat[Math.floor(index / 3)] === 0));
}

// The triangles that are nearest to a point of the mesh's frame, at most `most` of them. Undefined if `most` is 0.
export function nearestTriangles(mesh: RoomMesh, centre: THREE.Vector3, most: number): RoomMesh | undefined {
  const { positions, triangles } = mesh;
  const count = triangles.length / 3;
  if (count <= most) return mesh;
  const distances = new Float32Array(count);
  const point = new THREE.Vector3();
  for (let triangle = 0; triangle < count; ++triangle) {
    let least = Infinity;
    for (let corner = 0; corner < 3; ++corner) least = Math.min(least, point.fromArray(positions, 3 * triangles[3 * triangle + corner]!).distanceToSquared(centre));
    distances[triangle] = least;
  }
  // Sorted by distance, and those of the same distance by number, so that the choice does not flicker.
  const order = Uint32Array.from(distances, (_, index) => index).sort((a, b) => distances[a]! - distances[b]! || a - b);
  const chosen = order.slice(0, most).sort();
  const corners = new Uint32Array(3 * chosen.length);
  chosen.forEach((triangle, index) => corners.set(triangles.subarray(3 * triangle, 3 * triangle + 3), 3 * index));
  return picked(positions, corners);
}

export function isSameMesh(a: RoomMesh, b: RoomMesh): boolean {
  return isSame(a.positions, b.positions) && isSame(a.triangles, b.triangles);
}

function isSame(a: ArrayLike<number>, b: ArrayLike<number>): boolean {
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; ++i) if (a[i] !== b[i]) return false;
  return true;
}

const isPlace = (value: number) => Math.abs(value) <= kLargest; // false for NaN

// Absolute cosine of the angle between a triangle and the plane y = 0.
function slopeOf(positions: Float32Array, a: number, b: number, c: number): number {
  const [ax, ay, az] = [positions[3 * a]!, positions[3 * a + 1]!, positions[3 * a + 2]!];
  const [ux, uy, uz] = [positions[3 * b]! - ax, positions[3 * b + 1]! - ay, positions[3 * b + 2]! - az];
  const [vx, vy, vz] = [positions[3 * c]! - ax, positions[3 * c + 1]! - ay, positions[3 * c + 2]! - az];
  const y = uz * vx - ux * vz;
  const length = Math.hypot(uy * vz - uz * vy, y, ux * vy - uy * vx);
  return length > 0 ? Math.abs(y) / length : 1;
}

// Whether a point is inside a polygon, or at most kFlatMargin away from it.
function isNearPolygon(corners: readonly THREE.Vector2[], x: number, y: number): boolean {
  let isInside = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [a, b] = [corners[j]!, corners[i]!];
    if (a.y > y !== b.y > y && x < ((b.x - a.x) * (y - a.y)) / (b.y - a.y) + a.x) isInside = !isInside;
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const along = THREE.MathUtils.clamp(((x - a.x) * dx + (y - a.y) * dy) / Math.max(dx * dx + dy * dy, 1e-12), 0, 1);
    if (Math.hypot(a.x + along * dx - x, a.y + along * dy - y) < kFlatMargin) return true;
  }
  return isInside;
}

// A mesh of these triangles and the vertices that they have. Undefined without triangles.
function picked(vertices: ArrayLike<number>, triangles: readonly number[] | Uint32Array): RoomMesh | undefined {
  if (triangles.length === 0) return undefined;
  const numbers = new Int32Array(vertices.length / 3).fill(-1);
  const positions: number[] = [];
  const corners = Uint32Array.from(triangles, (vertex) => {
    if (numbers[vertex]! < 0) {
      numbers[vertex] = positions.length / 3;
      positions.push(vertices[3 * vertex]!, vertices[3 * vertex + 1]!, vertices[3 * vertex + 2]!);
    }
    return numbers[vertex]!;
  });
  return { positions: new Float32Array(positions), triangles: corners };
}
