// SPDX-License-Identifier: Apache-2.0
// Where a gyro's model has learned: labels by temperature and by how that was changing, and where it is now.
import type { PlainCoverage } from './messages.ts';

export interface CoverageMap {
  from: number[]; // degC, where each column begins
  step: number; // degC
  rows: { name: string; range: string; labels: number[] }[]; // warming first
  here?: { row: number; column: number };
  sentence: string;
}

const NAMES = ['cooling fast', 'cooling', 'steady', 'warming', 'warming fast'];
const signed = (edge: number) => `${edge < 0 ? '−' : '+'}${Math.abs(edge)}`;

function rangeText(edges: number[], rate: number): string {
  if (rate === 0) return `below ${signed(edges[0])}`;
  if (rate === edges.length) return `above ${signed(edges[rate - 1])}`;
  return `${signed(edges[rate - 1])} to ${signed(edges[rate])}`;
}

/** Of several axes the fewest labels, of those that learned anything: nowhere more is known than that. Nothing where there is neither a label nor a temperature. `isPast`: `now` is what was known last. */
export function coverageMap(coverage: PlainCoverage, axes: readonly number[], now?: { degc: number; degcPerMin: number }, isPast = false): CoverageMap | undefined {
  const { step, edges, cells } = coverage;
  const learning = axes.filter((a) => cells.some((cell) => cell.labels[a] > 0));
  const count = (labels: number[]) => (learning.length === 0 ? 0 : Math.min(...learning.map((a) => labels[a])));
  const isKnown = now !== undefined && Number.isFinite(now.degc) && Number.isFinite(now.degcPerMin);
  const nowFrom = isKnown ? Math.floor(now.degc / step) * step : NaN;
  const begins = [...cells.filter((cell) => count(cell.labels) > 0).map((cell) => cell.from), nowFrom].filter(Number.isFinite);
  if (begins.length === 0) return undefined;
  const [lowest, highest] = [Math.min(...begins), Math.max(...begins)];
  const from = Array.from({ length: Math.round((highest - lowest) / step) + 1 }, (_, i) => lowest + i * step);
  const labels = Array.from({ length: edges.length + 1 }, () => from.map(() => 0));
  for (const cell of cells) {
    const column = Math.round((cell.from - lowest) / step);
    if (column >= 0 && column < from.length && cell.rate <= edges.length) labels[cell.rate][column] = count(cell.labels);
  }
  const nameOf = (rate: number) => (edges.length + 1 === NAMES.length ? NAMES[rate] : rangeText(edges, rate));
  const last = edges.length;
  const rows = labels.map((_, i) => ({ name: nameOf(last - i), range: rangeText(edges, last - i), labels: labels[last - i] }));
  if (!isKnown) return { from, step, rows, sentence: 'The temperature now is not known.' };
  const rate = edges.filter((edge) => now.degcPerMin >= edge).length;
  const here = { row: last - rate, column: Math.round((nowFrom - lowest) / step) };
  const known = rows[here.row].labels[here.column];
  const what = known === 0 ? 'nothing learned there yet' : `${known} label${known === 1 ? '' : 's'} learned there`;
  const sentence = `${isPast ? 'Last known:' : 'Now'} ${now.degc.toFixed(1).replace('-', '−')} °C and ${nameOf(rate)}: ${what}.`;
  return isPast ? { from, step, rows, sentence } : { from, step, rows, here, sentence };
}
