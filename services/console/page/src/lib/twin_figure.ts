// SPDX-License-Identifier: Apache-2.0
// What a diagnosis left over, against the input that the missing effect follows, and who else might explain it.
import type { PlainTwin } from './messages.ts';
import { extent, niceRange, type Range } from './scale.ts';

export interface ResidualFigure {
  /** input, ascending; measured minus twin; mean of what the repair explains of it, at the bins' middles alone */
  columns: Float64Array[];
  x: Range;
  y: Range;
}

interface Row {
  input: number;
  left: number;
  explained: number;
}

const LEAST_POINTS = 3;
const BINS = 40; // of equal width, over all inputs

/** Means of each bin that has rows, with the input's own mean as its place. */
function binned(rows: Row[], low: number, high: number): Row[] {
  const bins: Row[][] = Array.from({ length: BINS }, () => []);
  for (const row of rows) bins[Math.min(BINS - 1, Math.floor((BINS * (row.input - low)) / (high - low || 1)))].push(row);
  const mean = (of: Row[], value: (row: Row) => number) => of.reduce((sum, row) => sum + value(row), 0) / of.length;
  return bins.filter((of) => of.length > 0).map((of) => ({ input: mean(of, (r) => r.input), left: NaN, explained: mean(of, (r) => r.explained) }));
}

/** Nothing where the report names no input. */
export function residualFigure(report: PlainTwin): ResidualFigure | undefined {
  const rows = Array.from(report.inputValue, (input, i) => ({
    input,
    left: report.measured[i] - report.twin[i],
    explained: report.repaired[i] - report.twin[i],
  })).filter((row) => Number.isFinite(row.input) && Number.isFinite(row.left) && Number.isFinite(row.explained));
  if (report.input === '' || rows.length < LEAST_POINTS) return undefined;
  const inputs = rows.map((row) => row.input);
  const [low, high] = [Math.min(...inputs), Math.max(...inputs)];
  const shown = [...rows.map((row) => ({ ...row, explained: NaN })), ...binned(rows, low, high)].sort((a, b) => a.input - b.input);
  const column = (of: (row: Row) => number) => Float64Array.from(shown, of);
  const columns = [column((r) => r.input), column((r) => r.left), column((r) => r.explained)];
  const range: Range = [Infinity, -Infinity];
  for (const values of columns.slice(1)) extent(columns[0], values, -Infinity, Infinity, range);
  const air = 0.03 * (high - low || 1);
  return { columns, x: [low - air, high + air], y: niceRange(range[0], range[1]) };
}

export interface Candidate {
  name: string;
  probability: number;
  isNamed: boolean;
}

/** The effect that was named, and those that explain nearly as well. */
export function candidates(effect: PlainTwin['effects'][number]): Candidate[] {
  return [{ name: effect.name, probability: effect.probability, isNamed: true }, ...effect.alternatives.map((other) => ({ ...other, isNamed: false }))];
}
