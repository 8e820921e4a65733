// SPDX-License-Identifier: Apache-2.0
// Minimum, mean and maximum of every column over buckets of equal width, aligned to multiples of the width so that a
// moving window does not shimmer. A hole in the data becomes one row of NaN. O(rows x columns), no allocation.
import type { Ring } from './ring.ts';

/** Columns of a ring that hold each series' least, mean and greatest. */
export interface Columns {
  lows: number[];
  means: number[];
  highs: number[];
}

/** Series after series, each `capacity` long; `rows` are used. */
export class Envelope {
  readonly columns: number;
  readonly capacity: number;
  readonly time: Float64Array;
  readonly low: Float64Array[];
  readonly mean: Float64Array[];
  readonly high: Float64Array[];
  rows = 0;

  private bucket = NaN;
  private width = 1;
  private samples = 0;
  private timeSum = 0;
  private lastTime = NaN;
  private readonly counts: Float64Array;
  private readonly sums: Float64Array;
  private readonly lows: Float64Array;
  private readonly highs: Float64Array;

  constructor(columns: number, capacity: number) {
    this.columns = columns;
    this.capacity = capacity;
    this.time = new Float64Array(capacity);
    const series = () => Array.from({ length: columns }, () => new Float64Array(capacity));
    this.low = series();
    this.mean = series();
    this.high = series();
    this.counts = new Float64Array(columns);
    this.sums = new Float64Array(columns);
    this.lows = new Float64Array(columns);
    this.highs = new Float64Array(columns);
    this.reset();
  }

  reset(): void {
    this.rows = 0;
    this.lastTime = NaN;
    this.emptyBucket(NaN);
  }

  private emptyBucket(bucket: number): void {
    this.bucket = bucket;
    this.samples = 0;
    this.timeSum = 0;
    this.counts.fill(0);
    this.sums.fill(0);
    this.lows.fill(Infinity);
    this.highs.fill(-Infinity);
  }

  private emit(time: number, longestStep: number): void {
    if (time - this.lastTime > longestStep && this.rows < this.capacity) {
      this.time[this.rows] = (time + this.lastTime) / 2;
      for (let c = 0; c < this.columns; ++c) {
        this.low[c][this.rows] = this.mean[c][this.rows] = this.high[c][this.rows] = NaN;
      }
      this.rows += 1;
    }
    this.lastTime = time;
    if (this.rows === this.capacity) return;
    this.time[this.rows] = time;
    for (let c = 0; c < this.columns; ++c) {
      const known = this.counts[c] > 0;
      this.low[c][this.rows] = known ? this.lows[c] : NaN;
      this.mean[c][this.rows] = known ? this.sums[c] / this.counts[c] : NaN;
      this.high[c][this.rows] = known ? this.highs[c] : NaN;
    }
    this.rows += 1;
  }

  /**
   * Adds rows `begin`..`end` of `ring`. `lows`, `means`, `highs` name the ring's columns of each series (the same one
   * three times where a row is one sample). `bucketNs` 0: every row for itself. `longestStep`: a longer one is a hole.
   * `offsetNs` is added to the times: half a second where a row is a second and its time the begin.
   */
  add(
    ring: Ring,
    begin: number,
    end: number,
    { lows, means, highs }: Columns,
    { bucketNs, longestStep, offsetNs = 0 }: { bucketNs: number; longestStep: number; offsetNs?: number },
  ): void {
    this.width = bucketNs > 0 ? bucketNs : 1;
    for (let i = begin; i < end; ++i) {
      const slot = ring.slot(i);
      const time = ring.time[slot] + offsetNs;
      const bucket = bucketNs > 0 ? Math.floor(time / bucketNs) : time;
      if (bucket !== this.bucket) {
        this.close(longestStep);
        this.emptyBucket(bucket);
      }
      this.samples += 1;
      this.timeSum += time - this.bucket * this.width;
      for (let c = 0; c < this.columns; ++c) {
        const mean = ring.columns[means[c]][slot];
        if (mean !== mean) continue;
        const low = ring.columns[lows[c]][slot];
        const high = ring.columns[highs[c]][slot];
        this.counts[c] += 1;
        this.sums[c] += mean;
        if (low < this.lows[c]) this.lows[c] = low;
        if (high > this.highs[c]) this.highs[c] = high;
      }
    }
    this.close(longestStep);
    this.emptyBucket(NaN);
  }

  private close(longestStep: number): void {
    if (this.samples === 0) return;
    this.emit(this.bucket * this.width + this.timeSum / this.samples, longestStep);
  }
}
