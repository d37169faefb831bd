// SPDX-License-Identifier: MIT
// The newest values of one figure, for medians and largest values.

export class Samples {
  private readonly values: Float32Array;
  private added = 0;

  // Memory for `capacity` values is allocated at once, and nothing later except by sorted().
  constructor(capacity: number) {
    this.values = new Float32Array(capacity);
  }

  // Number of values that are kept.
  get count(): number {
    return Math.min(this.added, this.values.length);
  }

  // Replaces the oldest value if there is no room left.
  add(value: number): void {
    this.values[this.added++ % this.values.length] = value;
  }

  // Copy in ascending order.
  sorted(): Float32Array {
    return this.values.slice(0, this.count).sort();
  }

  // Value below which a part of the values lies, 0 to 1. Undefined without values.
  quantile(part: number): number | undefined {
    const sorted = this.sorted();
    return sorted[Math.round(part * (sorted.length - 1))];
  }
}
