// SPDX-License-Identifier: Apache-2.0
// All that the page keeps of one gyro: a ring at full rate, a ring of one-second rows, a ring of attitudes.
import { csvParts } from './csv.ts';
import { Envelope, type Columns } from './envelope.ts';
import type { Angles, AttitudeSeries, View, ViewRequest } from './messages.ts';
import { Ring } from './ring.ts';

export const SAMPLE_ROWS = 131_072; // 10.9 min at 200 Hz, 65 s at 2 kHz
export const HISTORY_ROWS = 43_264; // 12 h of seconds
const ATTITUDE_ROWS = 20_000;
const ATTITUDE_EVERY_NS = 0.5e9;
const BESIDE_NS = 1e9;
const STREAMS = ['raw', 'compensated', 'reference'] as const; // idl/proto/telemetry.proto, NavigationState
const ANGLES = ['headingError', 'attitudeError', 'roll', 'pitch'] as const;
export const MOST_PROBES = 8;
const MOST_BUCKETS = 4096;

// Columns of the full-rate ring, a triple x y z each.
const RAW = 0;
const COMPENSATED = 3;
const DRIFT = 6;
const SIGMA = 9;
const SAMPLE_COLUMNS = 12;

// Columns of the one-second ring: eleven an axis, then two a probe.
const PER_AXIS = 11;
const RAW_LOW = 0;
const RAW_MEAN = 1;
const RAW_HIGH = 2;
const COMPENSATED_LOW = 3;
const COMPENSATED_MEAN = 4;
const COMPENSATED_HIGH = 5;
const DRIFT_MEAN = 6;
const DRIFT_SIGMA = 7;
const REFERENCE = 8;
const RESIDUAL = 9;
const MODE = 10;
const PROBES = 3 * PER_AXIS;
const HISTORY_COLUMNS = PROBES + 2 * MOST_PROBES;

const RESTART_NS = 2e9; // a step back by more means that the source began anew
const AXES = [0, 1, 2];

const ofAxes = (column: number): number[] => AXES.map((a) => a * PER_AXIS + column);
const triple = (first: number): number[] => AXES.map((a) => first + a);

const same = (columns: number[]): Columns => ({ lows: columns, means: columns, highs: columns });

const SAMPLE_SERIES = same([...triple(RAW), ...triple(COMPENSATED), ...triple(DRIFT), ...triple(SIGMA)]);
const HISTORY_SERIES: Columns = {
  lows: [RAW_LOW, COMPENSATED_LOW, DRIFT_MEAN, DRIFT_SIGMA].flatMap(ofAxes),
  means: [RAW_MEAN, COMPENSATED_MEAN, DRIFT_MEAN, DRIFT_SIGMA].flatMap(ofAxes),
  highs: [RAW_HIGH, COMPENSATED_HIGH, DRIFT_MEAN, DRIFT_SIGMA].flatMap(ofAxes),
};
const SLOW_SERIES = same([...ofAxes(RESIDUAL), ...Array.from({ length: 2 * MOST_PROBES }, (_, i) => PROBES + i)]);

const ROW_NS = 1e9; // of the history
const HALF_ROW_NS = 0.5e9;
const ROWS_HOLE_NS = 2.5e9;
const SHORTEST_FOLLOWED_S = 10;

/** Columns of equal length, oldest first; deg/h. */
export interface SampleColumns {
  timeNs: bigint[];
  raw: number[][];
  compensated: number[][];
  sigma: number[];
}

export interface AxisColumns {
  rawLow: number[];
  rawMean: number[];
  rawHigh: number[];
  compensatedLow: number[];
  compensatedMean: number[];
  compensatedHigh: number[];
  drift: number[];
  sigma: number[];
  reference: number[];
  mode: Uint8Array; // one a row, see telemetry.proto
}

export interface HistoryColumns {
  isBacklog: boolean;
  timeNs: bigint[];
  axes: AxisColumns[];
  probes: { probe: string; temperature: number[]; rate: number[] }[];
}

const at = (values: number[] | undefined, i: number): number => values?.[i] ?? NaN;

export class GyroStore {
  readonly gyro: number;
  readonly samples = new Ring(SAMPLE_ROWS, SAMPLE_COLUMNS);
  readonly history = new Ring(HISTORY_ROWS, HISTORY_COLUMNS);
  readonly probes: string[] = [];
  hasReference = false;
  sampleIntervalS = NaN;
  private epochNs: bigint | undefined;
  private readonly attitudes = STREAMS.map(() => new Ring(ATTITUDE_ROWS, ANGLES.length));
  private readonly fast = new Envelope(SAMPLE_SERIES.means.length, MOST_BUCKETS);
  private readonly slow = new Envelope(SLOW_SERIES.means.length, MOST_BUCKETS);

  constructor(gyro: number) {
    this.gyro = gyro;
  }

  private since(ns: bigint): number {
    this.epochNs ??= ns;
    return Number(ns - this.epochNs);
  }

  /** Sensor time in seconds of a ring's time. */
  seconds(ns: number): number {
    return Number(this.epochNs ?? 0n) * 1e-9 + ns * 1e-9;
  }

  private nanoseconds(s: number): number {
    return (s - Number(this.epochNs ?? 0n) * 1e-9) * 1e9;
  }

  private beginAnew(): void {
    this.samples.clear();
    this.history.clear();
    this.attitudes.forEach((ring) => ring.clear());
    this.hasReference = false;
  }

  addSamples(batch: SampleColumns): void {
    const count = batch.timeNs.length;
    if (count === 0) return;
    if (this.samples.size > 0 && this.since(batch.timeNs[count - 1]) < this.samples.newest - RESTART_NS) this.beginAnew();
    const columns = this.samples.columns;
    for (let i = 0; i < count; ++i) {
      const slot = this.samples.open(this.since(batch.timeNs[i]));
      if (slot < 0) continue; // known: after a reconnection, or a standby's repetition
      for (const a of AXES) {
        const raw = at(batch.raw[a], i);
        const compensated = at(batch.compensated[a], i);
        columns[RAW + a][slot] = raw;
        columns[COMPENSATED + a][slot] = compensated;
        columns[DRIFT + a][slot] = raw - compensated;
        columns[SIGMA + a][slot] = batch.sigma[a];
      }
    }
  }

  private probeColumn(probe: string): number {
    let known = this.probes.indexOf(probe);
    if (known < 0 && this.probes.length < MOST_PROBES) {
      known = this.probes.push(probe) - 1;
      this.history.columns[PROBES + 2 * known].fill(NaN);
      this.history.columns[PROBES + 2 * known + 1].fill(NaN);
    }
    return known < 0 ? -1 : PROBES + 2 * known;
  }

  /** Of a backlog what is known already stays: that of a gateway that has just started is short. */
  addHistory(rows: HistoryColumns): void {
    const columns = this.history.columns;
    const count = rows.timeNs.length;
    const isKnown = rows.isBacklog && this.history.size > 0 && count > 0 && this.since(rows.timeNs[count - 1]) >= this.history.newest - RESTART_NS;
    const knownTo = isKnown ? this.history.newest : -Infinity;
    for (let i = 0; i < count; ++i) {
      const time = this.since(rows.timeNs[i]);
      if (time < knownTo) continue;
      if (this.history.size > 0 && time < this.history.newest - RESTART_NS) this.beginAnew();
      const again = this.history.size > 0 && time === this.history.newest;
      const slot = again ? this.history.slot(this.history.size - 1) : this.history.open(time);
      if (slot < 0) continue;
      for (let c = PROBES; c < HISTORY_COLUMNS; ++c) columns[c][slot] = NaN;
      for (const a of AXES) {
        const axis = rows.axes[a];
        const put = (column: number, value: number) => (columns[a * PER_AXIS + column][slot] = value);
        put(RAW_LOW, at(axis?.rawLow, i));
        put(RAW_MEAN, at(axis?.rawMean, i));
        put(RAW_HIGH, at(axis?.rawHigh, i));
        put(COMPENSATED_LOW, at(axis?.compensatedLow, i));
        put(COMPENSATED_MEAN, at(axis?.compensatedMean, i));
        put(COMPENSATED_HIGH, at(axis?.compensatedHigh, i));
        put(DRIFT_MEAN, at(axis?.drift, i));
        put(DRIFT_SIGMA, at(axis?.sigma, i));
        put(REFERENCE, at(axis?.reference, i));
        put(MODE, axis?.mode[i] ?? NaN);
        put(RESIDUAL, at(axis?.compensatedMean, i) - at(axis?.reference, i));
        if (Number.isFinite(at(axis?.reference, i))) this.hasReference = true;
      }
      for (const probe of rows.probes) {
        const column = this.probeColumn(probe.probe);
        if (column < 0) continue;
        columns[column][slot] = at(probe.temperature, i);
        columns[column + 1][slot] = at(probe.rate, i);
      }
    }
  }

  addAttitude(stream: number, timeNs: bigint, angles: Angles): void {
    const ring = this.attitudes[stream];
    if (!ring) return;
    const time = this.since(timeNs);
    if (ring.size > 0 && time < ring.newest - RESTART_NS) ring.clear();
    if (ring.size > 0 && time < ring.newest + ATTITUDE_EVERY_NS) return;
    const slot = ring.open(time);
    if (slot >= 0) ANGLES.forEach((angle, column) => (ring.columns[column][slot] = angles[angle]));
  }

  /** Of the three streams at the times of the compensated one; NaN where another has nothing within a second. */
  attitudeSeries(points: number): AttitudeSeries {
    const leading = this.attitudes[1];
    const count = Math.min(points, leading.size);
    const times = Array.from({ length: count }, (_, k) => leading.timeAt(Math.floor((k * leading.size) / count)));
    const column = (ring: Ring, c: number) =>
      Float64Array.from(times, (ns) => {
        const row = ring.nearest(ns);
        return row >= 0 && Math.abs(ring.timeAt(row) - ns) < BESIDE_NS ? ring.columns[c][ring.slot(row)] : NaN;
      });
    const of = (c: number) => this.attitudes.map((ring) => column(ring, c));
    return { gyro: this.gyro, time: Float64Array.from(times, (ns) => this.seconds(ns)), headingError: of(0), attitudeError: of(1), roll: of(2), pitch: of(3) };
  }

  get oldestNs(): number {
    if (this.history.size > 0 && this.samples.size > 0) return Math.min(this.history.oldest, this.samples.oldest);
    return this.history.size > 0 ? this.history.oldest : this.samples.oldest;
  }

  get newestNs(): number {
    if (this.samples.size === 0) return this.history.newest;
    return this.history.size > 0 ? Math.max(this.samples.newest, this.history.newest) : this.samples.newest;
  }

  /** The series of a window. O(rows in it), one allocation a series for the message. */
  view(request: ViewRequest): View {
    const to = request.follow ? this.seconds(this.newestNs) : request.to;
    // Following, the window is no longer than what there is to show.
    const oldest = this.seconds(this.oldestNs);
    const span = request.follow ? Math.min(request.span, Math.max(SHORTEST_FOLLOWED_S, to - oldest)) : request.span;
    const from = to - span;
    const fromNs = this.nanoseconds(from);
    const toNs = this.nanoseconds(to);
    const buckets = Math.max(16, Math.min(request.buckets, MOST_BUCKETS / 2 - 8));
    const bucketS = Math.max(span / buckets, request.averageS);
    this.fillFast(fromNs, toNs, bucketS * 1e9, buckets, request.averageS > 0);
    this.fillSlow(fromNs, toNs, bucketS * 1e9, buckets);
    const fast = this.fast;
    const slow = this.slow;
    const cut = (series: Float64Array[], first: number, count: number, rows: number) =>
      series.slice(first, first + count).map((s) => s.slice(0, rows));
    const time = (series: Envelope) => series.time.slice(0, series.rows).map((ns) => this.seconds(ns));
    const probes = this.probes.map((_, p) => slow.mean[3 + 2 * p].slice(0, slow.rows));
    return {
      id: request.id,
      gyro: this.gyro,
      from,
      to,
      bucketS,
      time: time(fast),
      low: cut(fast.low, 0, 6, fast.rows),
      mean: cut(fast.mean, 0, 6, fast.rows),
      high: cut(fast.high, 0, 6, fast.rows),
      drift: cut(fast.mean, 6, 3, fast.rows),
      sigma: cut(fast.mean, 9, 3, fast.rows),
      slowTime: time(slow),
      residual: cut(slow.mean, 0, 3, slow.rows),
      temperature: probes,
      temperatureRate: this.probes.map((_, p) => slow.mean[4 + 2 * p].slice(0, slow.rows)),
      probes: [...this.probes],
      hasReference: this.hasReference,
      oldest,
      newest: this.seconds(this.newestNs),
    };
  }

  /** History up to where the full rate begins, then the full rate. A bucket that is not complete yet waits. */
  private fillFast(fromNs: number, toNs: number, bucketNs: number, buckets: number, averages: boolean): void {
    const { samples, history, fast } = this;
    fast.reset();
    const begin = Math.floor(fromNs / bucketNs) * bucketNs;
    const rows = history.size > 0 && history.oldest < samples.oldest;
    // The bucket in which the full rate begins is left to the history, where there is one.
    const ringBegin = rows && samples.oldest > begin ? Math.ceil(samples.oldest / bucketNs) * bucketNs : begin;
    const first = samples.lowerBound(ringBegin);
    const covered = first < samples.size ? samples.timeAt(first) : Infinity;
    const historyFrom = history.lowerBound(begin - ROW_NS);
    const historyTo = history.lowerBound(Math.min(toNs + 1, covered - ROW_NS + 1));
    if (historyTo > historyFrom) {
      const direct = !averages && historyTo - historyFrom <= buckets;
      const longestStep = Math.max(ROWS_HOLE_NS, 2.5 * bucketNs);
      fast.add(history, historyFrom, historyTo, HISTORY_SERIES, { bucketNs: direct ? 0 : bucketNs, longestStep, offsetNs: HALF_ROW_NS });
    }
    const last = samples.lowerBound(toNs + 1);
    if (last <= first) return;
    const direct = !averages && last - first <= buckets && historyTo <= historyFrom;
    const whole = samples.lowerBound(Math.floor(toNs / bucketNs) * bucketNs);
    const end = direct || (whole <= first && historyTo <= historyFrom) ? last : Math.max(first, whole);
    const stepNs = Number.isFinite(this.sampleIntervalS) ? this.sampleIntervalS * 1e9 : 1e8;
    const longestStep = Math.max(3 * stepNs, 2.5 * bucketNs, historyTo > historyFrom ? ROWS_HOLE_NS : 0);
    fast.add(samples, first, end, SAMPLE_SERIES, { bucketNs: direct ? 0 : bucketNs, longestStep });
  }

  private fillSlow(fromNs: number, toNs: number, bucketNs: number, buckets: number): void {
    const { history, slow } = this;
    slow.reset();
    const first = history.lowerBound(Math.floor(fromNs / bucketNs) * bucketNs - ROW_NS);
    const last = history.lowerBound(toNs + 1);
    const longestStep = Math.max(ROWS_HOLE_NS, 2.5 * bucketNs);
    slow.add(history, first, last, SLOW_SERIES, { bucketNs: last - first <= buckets ? 0 : bucketNs, longestStep, offsetNs: HALF_ROW_NS });
  }

  csv(from: number, to: number): { parts: string[]; rows: number } {
    const parts = [
      ...csvParts({
        samples: this.samples,
        history: this.history,
        epochNs: this.epochNs ?? 0n,
        fromNs: this.nanoseconds(from),
        toNs: this.nanoseconds(to),
        sampleColumns: [...triple(RAW), ...triple(COMPENSATED)],
        historyColumns: [...ofAxes(RAW_MEAN), ...ofAxes(COMPENSATED_MEAN)],
        historyReference: ofAxes(REFERENCE),
        probes: this.probes.map((name, p) => ({ name, column: PROBES + 2 * p })),
      }),
    ];
    const rows = parts.reduce((sum, part) => sum + part.split('\n').length - 1, 0) - 1;
    return { parts, rows };
  }
}
