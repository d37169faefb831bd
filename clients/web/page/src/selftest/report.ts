// SPDX-License-Identifier: MIT
// The report of a self-test, as it is saved. docs/selftest.md describes every member; kVersion grows when one changes.

import type { Samples } from "../samples";

export const kSchema = "clothstream-selftest";
export const kVersion = 1;

// Milliseconds.
export interface Spread {
  median: number;
  p99: number;
  largest: number;
}

// Share of the drawn frames in which the device showed each side, 0 to 1.
export interface Sides {
  left: number;
  right: number;
}

// null: not measured, or not said by the browser.
export interface Report {
  schema: typeof kSchema;
  version: typeof kVersion;
  date: string; // ISO 8601
  requestedSeconds: number;
  seconds: number; // measured
  complete: boolean;
  device: {
    userAgent: string;
    processors: number | null;
    graphics: string | null;
  };
  page: { secure: boolean; isolated: boolean };
  session: {
    mode: string | null; // null: in a window
    features: string[] | null;
    rates: number[] | null; // offered, Hz
    rate: number | null; // chosen, Hz
    interruptions: number; // hidden or blurred by the system
  };
  display: {
    frames: number;
    rate: number; // Hz
    gapMs: Spread | null;
    longGaps: number; // longer than one and a half times the median
  };
  stream: {
    scene: string;
    vertices: number;
    nominalRate: number; // Hz
    frames: number;
    rate: number; // Hz
    dropped: number;
    decodeErrors: number;
    hashMismatches: number;
    reconnects: number;
    kbitPerSecond: number | null;
    roundTripMs: number | null;
  };
  threads: {
    decodeMs: Spread | null; // worker, for a frame of the stream
    takeMs: Spread | null; // main thread, for a frame of the stream
    inputMs: Spread | null; // main thread, for a drawn frame
    showMs: Spread | null;
    renderMs: Spread | null;
  };
  poseToDisplayableMs: Spread | null;
  hands: Sides | null;
  controllers: Sides | null;
  touch: {
    share: number; // of drawn frames in which local contact moved the cloth
    largestCorrectionMm: number;
  } | null;
  grabs: {
    presses: number;
    taken: number; // presses that found cloth
    confirmed: number; // of which the server holds vertices
    slipped: number;
    longestSeconds: number;
  } | null;
}

export function spread(samples: Samples): Spread | null {
  const sorted = samples.sorted();
  if (sorted.length === 0) return null;
  const at = (part: number) => rounded(sorted[Math.round(part * (sorted.length - 1))]!);
  return { median: at(0.5), p99: at(0.99), largest: at(1) };
}

// With three decimals, enough for microseconds.
export function rounded(value: number): number {
  return Math.round(1000 * value) / 1000;
}
