// SPDX-License-Identifier: Apache-2.0
// A ring of rows by columns, allocated once. Column 0 of a row is its time: nanoseconds since `epoch_ns`, which keeps
// them exact in a double for 104 days. Times grow; what doesn't is refused.

export type PushResult = 'kept' | 'not_newer';

export class Ring {
  readonly capacity: number;
  readonly time: Float64Array;
  readonly columns: Float64Array[];
  private start = 0;
  private count = 0;

  constructor(capacity: number, columns: number) {
    this.capacity = capacity;
    this.time = new Float64Array(capacity);
    this.columns = Array.from({ length: columns }, () => new Float64Array(capacity));
  }

  get size(): number {
    return this.count;
  }

  /** Where row `i` (0 = oldest) lies in `time` and `columns`. */
  slot(i: number): number {
    const at = this.start + i;
    return at < this.capacity ? at : at - this.capacity;
  }

  timeAt(i: number): number {
    return this.time[this.slot(i)];
  }

  get oldest(): number {
    return this.count === 0 ? NaN : this.time[this.start];
  }

  get newest(): number {
    return this.count === 0 ? NaN : this.timeAt(this.count - 1);
  }

  clear(): void {
    this.start = 0;
    this.count = 0;
  }

  /** Slot of a new newest row, whose columns the caller fills; -1 when `time` is not newer than the newest. O(1). */
  open(time: number): number {
    if (this.count > 0 && !(time > this.newest)) return -1;
    if (this.count === this.capacity) {
      this.start = this.slot(1);
    } else {
      this.count += 1;
    }
    const slot = this.slot(this.count - 1);
    this.time[slot] = time;
    return slot;
  }

  /** The row closest in time; -1 when there is none. O(log n). */
  nearest(time: number): number {
    const after = this.lowerBound(time);
    const isBefore = after === this.count || (after > 0 && time - this.timeAt(after - 1) < this.timeAt(after) - time);
    return isBefore ? after - 1 : after;
  }

  /** First row whose time is not before `time`; `size` when there is none. O(log n). */
  lowerBound(time: number): number {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >>> 1;
      if (this.timeAt(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
