// SPDX-License-Identifier: MIT
// Counts of datagrams between two samples. Their counters start again when they are opened again.

import type { DatagramStatistics } from "@clothstream/client";

export const kLinkCounts = ["packets", "lostPackets", "parityPackets", "repairedFrames", "requests"] as const;
export type LinkCounts = Record<(typeof kLinkCounts)[number], number>;

export class LinkCounter {
  private before: DatagramStatistics | undefined;

  // Counts since the last call. Undefined: no datagrams are open.
  take(now: DatagramStatistics | undefined): LinkCounts {
    const before = now && this.before && now.packets >= this.before.packets ? this.before : undefined;
    this.before = now;
    const grown = (name: keyof LinkCounts) => Math.max(0, (now?.[name] ?? 0) - (before?.[name] ?? 0));
    return Object.fromEntries(kLinkCounts.map((name) => [name, grown(name)])) as LinkCounts;
  }
}
