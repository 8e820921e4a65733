// SPDX-License-Identifier: Apache-2.0

/** The newest `capacity` values and their quantiles. */
export class LatencyWindow {
  private readonly values: Float64Array;
  private next = 0;
  count = 0;

  constructor(capacity: number) {
    this.values = new Float64Array(capacity);
  }

  add(value: number): void {
    this.values[this.next] = value;
    this.next = (this.next + 1) % this.values.length;
    this.count = Math.min(this.count + 1, this.values.length);
  }

  /** The p-quantile (nearest rank); NaN when there are none. */
  quantile(p: number): number {
    if (this.count === 0) return NaN;
    const sorted = this.values.slice(0, this.count).sort();
    return sorted[Math.min(this.count, Math.max(1, Math.ceil(p * this.count))) - 1];
  }

  clear(): void {
    this.next = 0;
    this.count = 0;
  }
}
