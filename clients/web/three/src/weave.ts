// SPDX-License-Identifier: MIT
// Surfaces of fabrics as texels: colour, normal and roughness of one tile that repeats without a seam.

// How the threads of a fabric cross, or what its surface has instead of threads.
export type Pattern = "plain" | "twill" | "satin" | "ripstop" | "grain" | "fibres" | "stipple";

// Threads along each edge of a tile. A multiple of the period of every pattern: 2, 4, 5 and 10.
export const kThreads = 40;

export interface Surface {
  size: number; // texels along each edge
  colour: Uint8Array; // RGBA, sRGB: factor of the fabric's colour, 1 at 200
  relief: Uint8Array; // RGBA: normal in XYZ
  roughness: Uint8Array; // RGBA: factor of the roughness in G
}

export interface Threads {
  pattern: Pattern;
  weft: number; // Fabric.weft
  variation: number; // Fabric.variation
}

const kFactorOne = 200;

export function weave({ pattern, weft, variation }: Threads, size: number): Surface {
  const heights = new Float32Array(size * size);
  const tones = new Float32Array(size * size);
  const texel = isWoven(pattern) ? wovenTexel(pattern, weft, variation) : flatTexel(pattern, variation);
  for (let row = 0; row < size; ++row) {
    for (let column = 0; column < size; ++column) {
      const index = row * size + column;
      const { height, tone } = texel((column + 0.5) / size, (row + 0.5) / size);
      heights[index] = height;
      tones[index] = tone;
    }
  }
  return { size, ...pack(heights, tones, size, weft) };
}

// Height in units of the distance between threads, and brightness.
interface Texel {
  height: number;
  tone: number;
}
type Woven = "plain" | "twill" | "satin" | "ripstop";

function isWoven(pattern: Pattern): pattern is Woven {
  return pattern === "plain" || pattern === "twill" || pattern === "satin" || pattern === "ripstop";
}

// Whether the warp thread, which runs along v, lies over the weft thread at a crossing.
function warpIsOver(pattern: Woven, warp: number, weft: number): boolean {
  switch (pattern) {
    case "plain":
    case "ripstop":
      return (warp + weft) % 2 === 0;
    case "twill":
      return (warp + weft) % 4 !== 0;
    case "satin":
      return (2 * warp + weft) % 5 !== 0;
  }
}

// Round threads that pass over and under each other.
function wovenTexel(pattern: Woven, weft: number, variation: number): (u: number, v: number) => Texel {
  const wrap = (thread: number) => (thread + kThreads) % kThreads;
  const level = (x: number, y: number) => (warpIsOver(pattern, wrap(x), wrap(y)) ? 1 : -1);
  // Every tenth thread of ripstop is a thick one.
  const thick = (thread: number) => (pattern === "ripstop" && thread % 10 === 0 ? 1.6 : 1);
  const warpTones = Array.from({ length: kThreads }, (_, i) => 1 + variation * (2 * hash(i, 17) - 1));
  const weftTones = Array.from({ length: kThreads }, (_, i) => 1 + variation * (2 * hash(i, 91) - 1));
  return (u, v) => {
    const x = u * kThreads;
    const y = v * kThreads;
    const i = Math.floor(x);
    const j = Math.floor(y);
    const across = x - i;
    const along = y - j;
    // The thread's level between the middles of two crossings.
    const warpNext = along < 0.5 ? level(i, j - 1) : level(i, j + 1);
    const weftNext = across < 0.5 ? level(i - 1, j) : level(i + 1, j);
    const here = level(i, j);
    const warpLevel = here + (warpNext - here) * ease(Math.abs(along - 0.5));
    const weftLevel = here + (weftNext - here) * ease(Math.abs(across - 0.5));
    const warpHeight = thick(i) * round(across) + 0.22 * warpLevel;
    const weftHeight = thick(j) * round(along) - 0.22 * weftLevel;
    const warpOnTop = warpHeight >= weftHeight;
    // Slubs: a thread is thicker and paler for some length.
    const slub = warpOnTop ? noise(3 * i + 0.5, y / 7, 3 * kThreads, kThreads / 7) : noise(x / 7, 3 * j + 0.5, kThreads / 7, 3 * kThreads);
    const height = Math.max(warpHeight, weftHeight);
    const tone = (warpOnTop ? warpTones[i]! : weft * weftTones[j]!) * (1 + variation * (slub - 0.5));
    return { height, tone: tone * (0.72 + 0.4 * Math.min(1, Math.max(0, height))) };
  };
}

function flatTexel(pattern: Exclude<Pattern, Woven>, variation: number): (u: number, v: number) => Texel {
  const layers = (u: number, v: number, cells: number) =>
    (noise(u * cells, v * cells, cells, cells) + 0.5 * noise(2 * u * cells, 2 * v * cells, 2 * cells, 2 * cells)) / 1.5;
  switch (pattern) {
    case "grain":
      return (u, v) => {
        // Creases between the cells of the skin, and pores.
        const warp = 0.6 * (layers(u, v, 10) - 0.5);
        const crease = Math.min(1, 2.2 * cellEdge(u * kThreads + warp, v * kThreads + warp, kThreads));
        return { height: 1.2 * crease + 0.4 * layers(u, v, 20), tone: (0.8 + 0.2 * crease) * (1 + variation * (2 * layers(u, v, 5) - 1)) };
      };
    case "fibres":
      return (u, v) => {
        const pulp = layers(u, v, 40) + layers(u + 0.31, v, 80);
        return { height: pulp, tone: 1 + variation * (pulp - 1) };
      };
    case "stipple":
      return (u, v) => {
        const bump = layers(u, v, 80);
        return { height: bump, tone: 1 + variation * (bump - 0.5) };
      };
  }
}

// Texels of heights and tones. Slopes wrap at the edges of the tile.
function pack(heights: Float32Array, tones: Float32Array, size: number, weft: number): Omit<Surface, "size"> {
  const colour = new Uint8Array(4 * size * size);
  const relief = new Uint8Array(4 * size * size);
  const roughness = new Uint8Array(4 * size * size);
  const perThread = size / kThreads;
  for (let row = 0; row < size; ++row) {
    const above = ((row + size - 1) % size) * size;
    const below = ((row + 1) % size) * size;
    for (let column = 0; column < size; ++column) {
      const at = row * size + column;
      const left = heights[row * size + ((column + size - 1) % size)]!;
      const right = heights[row * size + ((column + 1) % size)]!;
      const x = 0.25 * perThread * (left - right);
      const y = 0.25 * perThread * (heights[above + column]! - heights[below + column]!);
      const scale = 127.5 / Math.hypot(x, y, 1);
      relief[4 * at] = 127.5 + scale * x;
      relief[4 * at + 1] = 127.5 + scale * y;
      relief[4 * at + 2] = 127.5 + scale;
      relief[4 * at + 3] = 255;
      const tone = tones[at]!;
      // A pale weft is undyed: its texels are nearly white, whatever the colour of the fabric.
      const pale = weft > 1 && tone > 1.3 ? 1.25 : 1;
      const value = Math.min(255, kFactorOne * Math.pow(Math.max(0, tone), 1 / 2.2));
      colour[4 * at] = Math.min(255, pale * value);
      colour[4 * at + 1] = Math.min(255, (pale > 1 ? 1.1 : 1) * value);
      colour[4 * at + 2] = value;
      colour[4 * at + 3] = 255;
      roughness[4 * at + 1] = Math.min(255, 255 * (1 - 0.18 * Math.min(1, Math.max(0, heights[at]!))));
      roughness[4 * at + 3] = 255;
    }
  }
  return { colour, relief, roughness };
}

const round = (across: number) => Math.sqrt(Math.max(0, 1 - (2 * across - 1) ** 2));
// From 0 in the middle of a crossing to 1/2 at its edge, where the neighbour's half begins.
const ease = (distance: number) => 0.5 * (1 - Math.cos(Math.PI * distance));

// Pseudo-random number in [0, 1) of two whole numbers.
export function hash(x: number, y: number): number {
  let bits = Math.imul(x, 0x27d4eb2d) ^ Math.imul(y, 0x165667b1);
  bits = Math.imul(bits ^ (bits >>> 15), 0x2c1b3c6d);
  bits = Math.imul(bits ^ (bits >>> 12), 0x297a2d39);
  return ((bits ^ (bits >>> 15)) >>> 0) / 2 ** 32;
}

// Smooth value noise in [0, 1), which repeats after the given numbers of cells.
export function noise(x: number, y: number, columns: number, rows: number): number {
  const wide = Math.max(1, Math.round(columns));
  const high = Math.max(1, Math.round(rows));
  const i = Math.floor(x);
  const j = Math.floor(y);
  const s = smooth(x - i);
  const t = smooth(y - j);
  const at = (column: number, row: number) => hash(modulo(column, wide), modulo(row, high));
  const upper = at(i, j) + s * (at(i + 1, j) - at(i, j));
  const lower = at(i, j + 1) + s * (at(i + 1, j + 1) - at(i, j + 1));
  return upper + t * (lower - upper);
}

// Distance to the edge between the two nearest of random points, one per cell (Worley 1996).
function cellEdge(x: number, y: number, cells: number): number {
  const i = Math.floor(x);
  const j = Math.floor(y);
  let nearest = 9;
  let second = 9;
  for (let row = j - 1; row <= j + 1; ++row) {
    for (let column = i - 1; column <= i + 1; ++column) {
      const dx = column + hash(modulo(column, cells), modulo(row, cells)) - x;
      const dy = row + hash(modulo(row, cells) + 977, modulo(column, cells)) - y;
      const distance = Math.hypot(dx, dy);
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
      } else second = Math.min(second, distance);
    }
  }
  return second - nearest;
}

const smooth = (t: number) => t * t * (3 - 2 * t);
const modulo = (value: number, period: number) => ((value % period) + period) % period;
