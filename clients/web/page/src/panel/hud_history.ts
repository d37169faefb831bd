// SPDX-License-Identifier: MIT
// Figures of the stream over the last minute.

import type { Link } from "@clothstream/client";
import { kLinkCounts } from "./link_counts";

export const kChannels = [
  "displayRate", // drawn frames per second
  "streamRate", // received frames per second
  "frameAge", // from the start of the newest frame's tick until now, ms
  "roundTrip", // ms
  "kbit", // kilobits per second
  "bitsPerVertex",
  "drops", // frames lost since the sample before
  "pause", // longest time between two frames since the sample before, ms
  // Stages from a pose to its picture, ms.
  "uplink",
  "server",
  "downlink",
  "decode",
  "playOut",
  // Datagrams since the sample before.
  ...kLinkCounts,
] as const;
export type Channel = (typeof kChannels)[number];
export type Sample = Record<Channel, number>;

export const kStages = ["uplink", "server", "downlink", "decode", "playOut"] as const;

// Keeps the newest `capacity` samples. Nothing is allocated after construction.
export class HudHistory {
  private readonly values: Record<Channel, Float32Array>;
  private count = 0;
  // How frames travel at the newest sample.
  link: Pick<Link, "transport" | "reason"> = { transport: "websocket", reason: "" };

  constructor(readonly capacity = 240) {
    this.values = Object.fromEntries(kChannels.map((name) => [name, new Float32Array(capacity)])) as Record<Channel, Float32Array>;
  }

  get length(): number {
    return Math.min(this.count, this.capacity);
  }

  // Number of samples since the start.
  get added(): number {
    return this.count;
  }

  add(sample: Sample): void {
    for (const name of kChannels) this.values[name][this.count % this.capacity] = sample[name];
    ++this.count;
  }

  // Value `ago` samples before the newest one; 0 before the first sample.
  at(channel: Channel, ago = 0): number {
    if (ago >= this.length) return 0;
    return this.values[channel][(this.count - 1 - ago) % this.capacity]!;
  }

  largest(channel: Channel): number {
    let most = 0;
    for (let ago = 0; ago < this.length; ++ago) most = Math.max(most, this.at(channel, ago));
    return most;
  }

  sum(channel: Channel): number {
    let sum = 0;
    for (let ago = 0; ago < this.length; ++ago) sum += this.at(channel, ago);
    return sum;
  }

  // Time of all stages, ms.
  latency(ago = 0): number {
    return kStages.reduce((sum, stage) => sum + this.at(stage, ago), 0);
  }
}
