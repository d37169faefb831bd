// SPDX-License-Identifier: MIT
// Where a mesh from a file is placed in a new scene, and which of its vertices are pinned.

export interface Bounds {
  min: [number, number, number];
  max: [number, number, number];
}

export const kPinChoices = ["top", "topCorners", "corners", "part", "none"] as const;
export type PinChoice = (typeof kPinChoices)[number];

// Vertices within this part of the height belong to an edge.
const kEdge = 0.01;
const kHangingHeight = 2; // m, of pinned cloth
const kFallingHeight = 1; // m, below falling cloth

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

// Indices of the pinned vertices, ascending. `part`: fraction of the height for "part", 0 to 1.
export function pinsOf(positions: Float32Array, choice: PinChoice, part: number): number[] {
  if (choice === "none" || positions.length === 0) return [];
  const bounds = boundsOf(positions);
  if (choice === "corners") return corners(positions, bounds);
  const height = bounds.max[1] - bounds.min[1];
  const from = bounds.max[1] - (choice === "part" ? Math.max(part, 1e-6) : kEdge) * height;
  const upper = select(positions, (_, y) => y >= from);
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

function select(positions: Float32Array, isIn: (x: number, y: number, z: number) => boolean): number[] {
  const found: number[] = [];
  for (let i = 0; i + 2 < positions.length; i += 3)
    if (isIn(positions[i]!, positions[i + 1]!, positions[i + 2]!)) found.push(i / 3);
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
