// SPDX-License-Identifier: MIT
// Appearance of each material of the server.

import type { Pattern } from "./weave";

export interface Fabric {
  pattern: Pattern;
  pitch: number; // distance of neighbouring threads, m; larger than real ones, so that a headset resolves them
  colour?: number; // sRGB; absent: the fabric is dyed, in a different colour for each cloth
  weft: number; // brightness of the weft compared with the warp; above 1 the weft is also paler
  variation: number; // spread of the brightness of threads, as a fraction
  reverse: number; // brightness of the back compared with the front
  roughness: number;
  relief: number; // scale of the normal map
  sheen: number;
  sheenRoughness: number;
  anisotropy: number; // stretch of highlights across the threads, 0 to 1
  translucency: number; // part of the light from behind that shines through, 0 to 1
}

const kPlain: Fabric = {
  pattern: "plain",
  pitch: 0.0016,
  weft: 0.94,
  variation: 0.06,
  reverse: 1,
  roughness: 0.86,
  relief: 0.8,
  sheen: 0.3,
  sheenRoughness: 0.5,
  anisotropy: 0,
  translucency: 0.2,
};

// Keys are the names of server/model/material.cpp.
const kFabrics: ReadonlyMap<string, Fabric> = new Map([
  ["cotton", kPlain],
  [
    "denim",
    {
      ...kPlain,
      pattern: "twill",
      pitch: 0.002,
      colour: 0x2b4264,
      weft: 1.9,
      variation: 0.26,
      reverse: 1.7,
      roughness: 0.92,
      relief: 1,
      sheen: 0.2,
      translucency: 0.03,
    },
  ],
  [
    "flag_nylon",
    { ...kPlain, pattern: "ripstop", pitch: 0.0014, variation: 0.04, weft: 1, roughness: 0.5, relief: 0.6, sheen: 0.15, translucency: 0.38 },
  ],
  [
    "leather",
    { ...kPlain, pattern: "grain", pitch: 0.003, colour: 0x7a4a2b, variation: 0.12, reverse: 1.25, roughness: 0.52, relief: 0.9, sheen: 0, translucency: 0 },
  ],
  [
    "paper",
    { ...kPlain, pattern: "fibres", pitch: 0.002, colour: 0xe9e4d8, variation: 0.03, roughness: 0.95, relief: 0.25, sheen: 0, translucency: 0.3 },
  ],
  [
    "rubber",
    { ...kPlain, pattern: "stipple", pitch: 0.002, colour: 0x34363b, variation: 0.02, roughness: 0.45, relief: 0.25, sheen: 0, translucency: 0 },
  ],
  [
    "silk",
    {
      ...kPlain,
      pattern: "satin",
      pitch: 0.0009,
      weft: 0.8,
      variation: 0.07,
      reverse: 0.86,
      roughness: 0.38,
      relief: 0.3,
      sheen: 0.55,
      sheenRoughness: 0.35,
      anisotropy: 0.5,
      translucency: 0.3,
    },
  ],
  [
    "wool",
    { ...kPlain, pattern: "twill", pitch: 0.0024, weft: 0.86, variation: 0.16, roughness: 0.95, relief: 0.7, sheen: 0.8, sheenRoughness: 0.7, translucency: 0.06 },
  ],
]);

// The look of a material. A cloth without a material, or with one of a newer server, looks like cotton.
export function fabricOf(material: string): Fabric {
  return kFabrics.get(material) ?? kPlain;
}

// Names of the materials that have a look of their own.
export function fabricNames(): string[] {
  return [...kFabrics.keys()];
}
