// SPDX-License-Identifier: Apache-2.0
import { quantile } from './statistics.ts';

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

  quantile(p: number): number {
    return quantile(this.values, this.count, p);
  }

  clear(): void {
    this.next = 0;
    this.count = 0;
  }
}
