// SPDX-License-Identifier: Apache-2.0
// The visible range as CSV: full-rate rows where the ring has them, one-second means before that. Column names carry
// units; `zerodrift allan --columns` takes the file.
import type { Ring } from './ring.ts';

const LINES_PER_PART = 4096;

export interface CsvRange {
  samples: Ring;
  history: Ring;
  epochNs: bigint;
  fromNs: number; // since the epoch, inclusive
  toNs: number; // inclusive
  /** columns of `samples` and of `history`: raw x y z, compensated x y z */
  sampleColumns: number[];
  historyColumns: number[];
  historyReference: number[]; // x y z
  probes: { name: string; column: number }[]; // of `history`
}

export function csvHeader(range: Pick<CsvRange, 'probes'>): string {
  const rates = ['raw', 'compensated', 'drift'].flatMap((what) => ['x', 'y', 'z'].map((axis) => `${what}_${axis}_deg_h`));
  const reference = ['x', 'y', 'z'].map((axis) => `reference_${axis}_deg_h`);
  const probes: string[] = [];
  for (const { name } of range.probes) {
    const stem = `temperature_${name.replace(/[^A-Za-z0-9]+/g, '_')}`;
    let column = `${stem}_degC`;
    for (let n = 2; probes.includes(column); ++n) column = `${stem}_${n}_degC`; // "coil 1" and "coil-1"
    probes.push(column);
  }
  return ['time_s', 'averaged_over_s', ...rates, ...reference, ...probes].join(',');
}

/** Nanoseconds as decimal seconds, all digits. */
export function seconds(ns: bigint): string {
  const sign = ns < 0n ? '-' : '';
  const size = ns < 0n ? -ns : ns;
  return `${sign}${size / 1_000_000_000n}.${String(size % 1_000_000_000n).padStart(9, '0')}`;
}

const cell = (value: number): string => (Number.isFinite(value) ? String(value) : '');

/** Parts of the file, header first; joined without anything between. Empty cells: nothing known. */
export function* csvParts(range: CsvRange): Generator<string> {
  const { samples, history } = range;
  let lines: string[] = [csvHeader(range)];
  const flush = () => {
    const part = lines.join('\n') + '\n';
    lines = [];
    return part;
  };
  const rates = (ring: Ring, slot: number, columns: number[]) => {
    const v = columns.map((c) => ring.columns[c][slot]);
    return [...v, v[0] - v[3], v[1] - v[4], v[2] - v[5]].map(cell).join(',');
  };
  const slow = (slot: number) =>
    slot < 0
      ? ','.repeat(2 + range.probes.length)
      : [...range.historyReference, ...range.probes.map((p) => p.column)].map((c) => cell(history.columns[c][slot])).join(',');

  const first = samples.lowerBound(range.fromNs);
  const coveredFrom = first < samples.size ? samples.timeAt(first) : Infinity;
  for (let i = history.lowerBound(range.fromNs); i < history.size; ++i) {
    const time = history.timeAt(i);
    // A second that the full rate covers in part is left to it.
    if (time > range.toNs || time + 1e9 > coveredFrom) break;
    const slot = history.slot(i);
    lines.push(`${seconds(range.epochNs + BigInt(time))},1,${rates(history, slot, range.historyColumns)},${slow(slot)}`);
    if (lines.length >= LINES_PER_PART) yield flush();
  }
  for (let i = first; i < samples.size; ++i) {
    const time = samples.timeAt(i);
    if (time > range.toNs) break;
    const row = history.lowerBound(time - 1e9 + 1); // the second it lies in
    const known = row < history.size && history.timeAt(row) <= time;
    const slot = samples.slot(i);
    lines.push(
      `${seconds(range.epochNs + BigInt(time))},0,${rates(samples, slot, range.sampleColumns)},${slow(known ? history.slot(row) : -1)}`,
    );
    if (lines.length >= LINES_PER_PART) yield flush();
  }
  if (lines.length > 0) yield flush();
}
