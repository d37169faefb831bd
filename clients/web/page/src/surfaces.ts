// SPDX-License-Identifier: MIT
// Textures of the room, computed: oak planks and plaster.

import * as THREE from "three";
import { hash, noise, tiled } from "@clothstream/three";

const kPlankTexels = 512;
const kPlanks = 10; // per tile
export const kPlankTile = 1.5; // m
const kPlasterTexels = 128;
const kPlasterTile = 2.2; // m

// Planks along U, each with its own tone and grain.
export function planks(): THREE.DataTexture {
  const size = kPlankTexels;
  const texels = new Uint8Array(4 * size * size);
  const dark = new THREE.Color(0x94704a);
  const pale = new THREE.Color(0xc9a679);
  const colour = new THREE.Color();
  for (let row = 0; row < size; ++row) {
    const v = ((row + 0.5) / size) * kPlanks;
    const plank = Math.floor(v);
    const across = v - plank;
    const joint = hash(plank, 5);
    for (let column = 0; column < size; ++column) {
      const u = (column + 0.5) / size;
      const from = Math.abs(u - joint);
      const end = Math.min(from, 1 - from) * kPlankTile;
      const piece = u < joint ? plank : plank + 40;
      const grain = noise(6 * u + 20 * hash(piece, 1), 14 * v, 6, 14 * kPlanks) + 0.5 * noise(24 * u, 40 * v, 24, 40 * kPlanks);
      const rings = 0.5 + 0.5 * Math.sin(9 * (across + 0.9 * noise(3 * u, v + 3 * hash(piece, 2), 3, kPlanks)) + 6 * hash(piece, 3));
      const tone = 0.18 + 0.34 * hash(piece, 9) + 0.22 * grain + 0.12 * rings;
      const gap = Math.min(across, 1 - across) * (kPlankTile / kPlanks);
      const edge = Math.min(1, Math.min(gap, end) / 0.004);
      colour.copy(dark).lerp(pale, Math.min(1, tone)).multiplyScalar(0.35 + 0.65 * edge).convertLinearToSRGB();
      texels.set([255 * colour.r, 255 * colour.g, 255 * colour.b, 255], 4 * (row * size + column));
    }
  }
  return tiled(texels, size, kPlankTile, THREE.SRGBColorSpace, 4);
}

// Slightly uneven, nearly white.
export function plaster(): THREE.DataTexture {
  const size = kPlasterTexels;
  const texels = new Uint8Array(4 * size * size);
  for (let row = 0; row < size; ++row) {
    for (let column = 0; column < size; ++column) {
      const u = column / size;
      const v = row / size;
      const cloud = noise(6 * u, 6 * v, 6, 6) + 0.5 * noise(15 * u, 15 * v, 15, 15) + 0.35 * noise(64 * u, 64 * v, 64, 64);
      const value = 246 + 4 * cloud;
      texels.set([value, value, value, 255], 4 * (row * size + column));
    }
  }
  return tiled(texels, size, kPlasterTile, THREE.SRGBColorSpace, 1);
}
