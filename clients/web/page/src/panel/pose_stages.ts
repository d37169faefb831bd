// SPDX-License-Identifier: MIT
// Time from a pose of this participant to the picture that shows its effect, divided into stages.

import type { Stages, Statistics } from "@clothstream/client";
import type { kStages } from "./hud_history";

export type PoseStages = Record<(typeof kStages)[number], number>; // ms

// All 0 before the first frame.
export function poseStages(statistics: Statistics | undefined, stages: Stages | undefined): PoseStages {
  return {
    uplink: (statistics?.roundTripMs ?? 0) / 2,
    server: stages?.serverMs ?? 0,
    downlink: Math.max(0, stages?.networkMs ?? 0),
    decode: stages?.decodeMs ?? 0,
    playOut: stages ? Math.max(0, stages.delayMs - stages.displayableMs) : 0,
  };
}
