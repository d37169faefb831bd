// SPDX-License-Identifier: MIT
// Where a mesh from a file is placed in a new scene, and which of its vertices are pinned.

export interface Bounds {
  min: [number, number, number];
  max: [number, number, number];
}

export type PinChoice = "top" | "topCorners" | "corners" | "box" | "none";

// Part of the bounds along each axis, as fractions from the lower to the upper end.
export type PinBox = readonly [from: number, to: number][];

// Vertices within this part of the height belong to an edge.
const kEdge = 0.01;
const kRounding = 1e-6; // of the ends of a box
const kHangingHeight = 2; // m, of pinned cloth
const kFallingHeight = 1; // m, below falling cloth
// Limits of the server (docs/meshes.md): largest coordinate and shortest mean edge, and the size that Mesh.fit gives, m.
const kWorld = 1000;
const kShortestEdge = 1e-4;
export const kFittedSize = 2;

// `positions`: 3 per vertex, at least one vertex.
export function boundsOf(positions: Float32Array): Bounds {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    const axis = (i % 3) as 0 | 1 | 2;
    min[axis] = Math.min(min[axis], positions[i]!);
    max[axis] = Math.max(max[axis], positions[i]!);
  }
  return { min, max };
}

export function sizeOf({ min, max }: Bounds): [number, number, number] {
  return [max[0] - min[0], max[1] - min[1], max[2] - min[2]];
}

// The same bounds around the origin.
export function centred(bounds: Bounds): Bounds {
  const [x, y, z] = sizeOf(bounds);
  return { min: [-x / 2, -y / 2, -z / 2], max: [x / 2, y / 2, z / 2] };
}

// Why a mesh does not fit the world of the server when it is scaled, as the end of a sentence; undefined if it does.
export function misfitOf(positions: Float32Array, triangles: Uint32Array, scale: number): string | undefined {
  const { min, max } = boundsOf(positions);
  const furthest = scale * Math.max(...min.map(Math.abs), ...max.map(Math.abs));
  const size = sizeOf({ min, max });
  if (furthest > kWorld) {
    const text = size.map((side) => shown(scale * side)).join(" x ");
    return `is ${text} m large and reaches ${shown(furthest)} m from the origin; the world ends at ${kWorld.toLocaleString("en")} m.`;
  }
  const edge = scale * meanEdge(positions, triangles);
  if (edge >= kShortestEdge) return undefined;
  return `has edges with a mean length of ${shown(1000 * edge)} mm; at least ${1000 * kShortestEdge} mm are needed.`;
}

function shown(value: number): string {
  return Number(value.toPrecision(3)).toLocaleString("en", { maximumSignificantDigits: 3 });
}

// Mean length of the edges of all triangles, in the unit of the positions; 0 without triangles.
export function meanEdge(positions: Float32Array, triangles: Uint32Array): number {
  let sum = 0;
  for (let i = 0; i < triangles.length; ++i) {
    const a = 3 * triangles[i]!;
    const b = 3 * triangles[i % 3 === 2 ? i - 2 : i + 1]!;
    sum += Math.hypot(positions[a]! - positions[b]!, positions[a + 1]! - positions[b + 1]!, positions[a + 2]! - positions[b + 2]!);
  }
  return triangles.length > 0 ? sum / triangles.length : 0;
}

// Length of the longest side that a new scene starts with, m: that of the file if it is the size of a cloth, else 1.5.
export function likelySize(longest: number): number {
  return longest >= 0.2 && longest <= 5 ? Number(longest.toPrecision(3)) : 1.5;
}

// Position that centres the mesh above the origin, m. Pinned cloth hangs high enough, other cloth falls.
export function placeOf({ min, max }: Bounds, scale: number, pinned: boolean): [number, number, number] {
  const height = scale * (max[1] - min[1]);
  const bottom = pinned ? Math.max(kHangingHeight - height, 0.1) : kFallingHeight;
  return [(-scale * (min[0] + max[0])) / 2, bottom - scale * min[1], (-scale * (min[2] + max[2])) / 2];
}

// Indices of the pinned vertices, ascending. `box`: three ranges, for "box".
export function pinsOf(positions: Float32Array, choice: PinChoice, box: PinBox): number[] {
  if (choice === "none" || positions.length === 0) return [];
  const bounds = boundsOf(positions);
  if (choice === "corners") return corners(positions, bounds);
  if (choice === "box") return inBox(positions, bounds, box);
  const from = bounds.max[1] - kEdge * (bounds.max[1] - bounds.min[1]);
  const upper = select(positions, (vertex) => positions[3 * vertex + 1]! >= from);
  if (choice !== "topCorners") return upper;
  // The ends of the upper edge along its longer direction.
  const along = extentOf(positions, upper, 0) >= extentOf(positions, upper, 2) ? 0 : 2;
  const at = (vertex: number) => positions[3 * vertex + along]!;
  const ends = [Math.min, Math.max].map((extreme) => upper.reduce((best, vertex) => (extreme(at(vertex), at(best)) === at(vertex) ? vertex : best)));
  return together(positions, ends);
}

// The vertices nearest to the corners of the largest side of the bounds.
function corners(positions: Float32Array, { min, max }: Bounds): number[] {
  const size = sizeOf({ min, max });
  const thin = size.indexOf(Math.min(...size));
  const [u, v] = [0, 1, 2].filter((axis) => axis !== thin) as [number, number];
  const nearest = [0, 1, 2, 3].map((corner) => {
    const goal = [corner & 1 ? max[u]! : min[u]!, corner & 2 ? max[v]! : min[v]!];
    let best = 0;
    let distance = Infinity;
    for (let vertex = 0; 3 * vertex < positions.length; ++vertex) {
      const away = Math.hypot(positions[3 * vertex + u]! - goal[0]!, positions[3 * vertex + v]! - goal[1]!);
      if (away < distance) [best, distance] = [vertex, away];
    }
    return best;
  });
  return together(positions, nearest);
}

// Adds vertices in the same place: the server makes one node of them.
function together(positions: Float32Array, vertices: number[]): number[] {
  const same = (a: number, b: number) => [0, 1, 2].every((axis) => positions[3 * a + axis] === positions[3 * b + axis]);
  const all = new Set<number>();
  for (let vertex = 0; 3 * vertex < positions.length; ++vertex)
    if (vertices.some((one) => same(one, vertex))) all.add(vertex);
  return [...all];
}

function inBox(positions: Float32Array, bounds: Bounds, box: PinBox): number[] {
  const size = sizeOf(bounds);
  const ends = box.map(([from, to], axis) => {
    const at = (part: number) => bounds.min[axis]! + part * size[axis]!;
    return [at(from) - kRounding * size[axis]!, at(to) + kRounding * size[axis]!] as const;
  });
  return select(positions, (vertex) =>
    ends.every(([from, to], axis) => positions[3 * vertex + axis]! >= from && positions[3 * vertex + axis]! <= to),
  );
}

// The vertices within `radius` of a point. Radius 0 finds those in the same place.
export function within(positions: Float32Array, [x, y, z]: readonly [number, number, number], radius: number): number[] {
  const most = radius * radius;
  return select(positions, (vertex) => {
    const [dx, dy, dz] = [positions[3 * vertex]! - x, positions[3 * vertex + 1]! - y, positions[3 * vertex + 2]! - z];
    return dx * dx + dy * dy + dz * dz <= most;
  });
}

function select(positions: Float32Array, isIn: (vertex: number) => boolean): number[] {
  const found: number[] = [];
  for (let vertex = 0; 3 * vertex < positions.length; ++vertex) if (isIn(vertex)) found.push(vertex);
  return found;
}

function extentOf(positions: Float32Array, vertices: number[], axis: number): number {
  const values = vertices.map((vertex) => positions[3 * vertex + axis]!);
  return values.reduce((a, b) => Math.max(a, b), -Infinity) - values.reduce((a, b) => Math.min(a, b), Infinity);
}

// Name of a scene for a file: only characters that the server allows.
export function nameFor(file: string): string {
  const stem = file.replace(/\.[^.]*$/, "").toLowerCase();
  return stem.normalize("NFKD").replace(/[^a-z0-9_-]+/g, "_").replace(/^_+|_+$/g, "").slice(0, 64) || "cloth";
}
