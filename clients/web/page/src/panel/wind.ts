// SPDX-License-Identifier: MIT
// Wind as speed, heading and rise. Heading 0 is away from the default camera (-Z) and 90 is to the right (+X); rise is
// the angle above the floor. Both are degrees.

import type { Vec3 } from "@clothstream/client";

export interface Wind {
  speed: number; // m/s
  heading: number;
  rise: number;
}

const kDegree = Math.PI / 180;

export function windOf([x, y, z]: Vec3): Wind {
  const speed = Math.hypot(x, y, z);
  if (speed === 0) return { speed, heading: 0, rise: 0 };
  const along = Math.hypot(x, z);
  return {
    speed,
    heading: along > 1e-6 * speed ? Math.atan2(x, -z) / kDegree : 0,
    rise: Math.atan2(y, along) / kDegree,
  };
}

export function vectorOf({ speed, heading, rise }: Wind): Vec3 {
  const along = speed * Math.cos(rise * kDegree);
  return [along * Math.sin(heading * kDegree), speed * Math.sin(rise * kDegree), -along * Math.cos(heading * kDegree)];
}
