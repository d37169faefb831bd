// SPDX-License-Identifier: MIT
// Tells whether frames come so late that a person should know. Pure.

// Pauses that count: at least this long, ms, and at least this number of usual intervals.
const kLateMs = 250;
const kLateIntervals = 4;
// Frames come late from this number of late samples, or one pause of this length, within kMemoryMs.
const kMostSamples = 3;
const kLongMs = 1000;
const kMemoryMs = 10_000;
// They come in time again after this time without a late sample.
const kGoodMs = 5000;

export class LateFrames {
  private samples: { atMs: number; pauseMs: number }[] = [];
  private isLate = false;

  // Takes the longest pause between frames since the last call. Call a few times per second.
  sample(pauseMs: number, intervalMs: number, nowMs: number): void {
    this.samples = this.samples.filter(({ atMs }) => nowMs - atMs < kMemoryMs);
    if (pauseMs >= Math.max(kLateMs, kLateIntervals * intervalMs)) this.samples.push({ atMs: nowMs, pauseMs });
    if (this.samples.length >= kMostSamples || this.samples.some(({ pauseMs: one }) => one >= kLongMs)) this.isLate = true;
  }

  // Longest of the late pauses, ms. Undefined while frames come in time.
  longestMs(nowMs: number): number | undefined {
    const newest = this.samples.at(-1);
    if (!newest || nowMs - newest.atMs >= kGoodMs) this.forget();
    return this.isLate ? Math.max(...this.samples.map(({ pauseMs }) => pauseMs)) : undefined;
  }

  forget(): void {
    this.samples = [];
    this.isLate = false;
  }
}
