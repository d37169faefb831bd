// SPDX-License-Identifier: MIT
// Colours of limits on the mesh of the preview: red for 0, over yellow and green to blue for the largest one.

// Limit of a vertex that has none.
export const kNoLimit = -1;

const kLastHue = 0.62; // blue; red is 0

// Hue of a limit, 0 to 1.
export function hueOf(limit: number, largest: number): number {
  return largest > 0 ? kLastHue * Math.min(limit / largest, 1) : 0;
}

// The largest limit; 0 if no vertex has one.
export function largestOf(limits: Float32Array): number {
  return limits.reduce((largest, limit) => Math.max(largest, limit), 0);
}

// What the colours mean, for people.
export function legendOf(limits: Float32Array, none: string): string {
  if (limits.every((limit) => limit < 0)) return `No vertex has one yet: ${none} everywhere.`;
  const largest = largestOf(limits);
  return `Red: 0 m${largest > 0 ? `, blue: ${Number(largest.toPrecision(3))} m` : ""}, grey: ${none}.`;
}
