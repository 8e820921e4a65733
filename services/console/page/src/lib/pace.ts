// SPDX-License-Identifier: Apache-2.0
const OVER_MS = 5000;
const LEAST_MS = 1500;
const MARK_EVERY_MS = 100;

/** Sensor seconds a second, over the last seconds. */
export class PaceMeter {
  private marks: { ms: number; s: number }[] = [];

  /** NaN while it is unknown: at first, where sensor time goes back, and after a silence, which is no slow pace. */
  mark(ms: number, sensorTimeS: number, silenceMs: number): number {
    const last = this.marks.at(-1);
    if (last && (sensorTimeS < last.s || ms - last.ms > silenceMs)) this.marks = [];
    if (this.marks.length === 0 || ms - this.marks[this.marks.length - 1].ms > MARK_EVERY_MS) this.marks.push({ ms, s: sensorTimeS });
    while (this.marks.length > 2 && ms - this.marks[1].ms > OVER_MS) this.marks.shift();
    const first = this.marks[0];
    return ms - first.ms > LEAST_MS ? (sensorTimeS - first.s) / ((ms - first.ms) * 1e-3) : NaN;
  }
}
