// SPDX-License-Identifier: MIT
// Pauses between frames, by the times at which they arrive.

export class FrameGaps {
  private newestMs: number | undefined;
  private longestMs = 0;

  // A frame has arrived, at a time of performance.now().
  arrived(atMs: number): void {
    if (this.newestMs !== undefined) this.longestMs = Math.max(this.longestMs, atMs - this.newestMs);
    this.newestMs = atMs;
  }

  // The time until the next frame does not count, because none is expected.
  restart(): void {
    this.newestMs = undefined;
  }

  // Longest pause since the last call, ms, with the one that still lasts. 0 before the second frame.
  take(nowMs: number): number {
    const longest = Math.max(this.longestMs, this.newestMs === undefined ? 0 : nowMs - this.newestMs);
    this.longestMs = 0;
    return longest;
  }
}
