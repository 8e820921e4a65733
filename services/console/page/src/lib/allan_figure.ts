// SPDX-License-Identifier: Apache-2.0
// Raw and compensated Allan deviation on one grid of cluster times, with what the coefficients alone would draw.
import type { PlainAllan, PlainAllanPoint, PlainCoefficient } from './messages.ts';
import { figure, type Range } from './scale.ts';

export type AllanSpan = 'since_start' | 'rolling';

export interface AllanFigure {
  /** tau; raw lower, upper, deviation; compensated lower, upper, deviation; guides of slope -1/2, 0, +1/2 */
  columns: Float64Array[];
  x: Range;
  y: Range;
}

const pointsOf = (report: PlainAllan | undefined, span: AllanSpan): PlainAllanPoint[] =>
  (span === 'rolling' ? report?.rolling : report?.sinceStart)?.filter((p) => p.tau > 0 && p.deviation > 0) ?? [];

const VALUE = 1;
const UPPER_BOUND = 2;
const UNEXPLAINED = 3;
const BAND_LIMITED = 4;

/** One that says something of the gyro: a value or an upper bound. */
export function coefficient(report: PlainAllan | undefined, symbol: string): PlainCoefficient | undefined {
  return report?.coefficients.find((c) => c.symbol === symbol && (c.identified === VALUE || c.identified === UPPER_BOUND));
}

/** Why a fitted coefficient is not stated; empty where none was fitted, or it is stated. */
export function whyWithheld(report: PlainAllan | undefined, symbol: string): string {
  const identified = report?.coefficients.find((c) => c.symbol === symbol)?.identified;
  if (identified === UNEXPLAINED) return `no mixture of noises explains the curve (reduced chi-square ${figure(report?.reducedChiSquare ?? NaN, 2)})`;
  return identified === BAND_LIMITED ? 'a bandwidth or filter hides all that is white' : '';
}

const B_FACTOR = Math.sqrt((2 * Math.LN2) / Math.PI); // 0.664, IEEE 952-1997 C.1.3

/** Deviation in deg/h that a coefficient alone gives at tau; IEEE 952-1997, annex C. N deg/sqrt(h), B deg/h, K deg/h/sqrt(h). */
export function deviationOf(symbol: 'N' | 'B' | 'K', value: number, tau: number): number {
  if (symbol === 'N') return (60 * value) / Math.sqrt(tau);
  if (symbol === 'B') return B_FACTOR * value;
  return (value * Math.sqrt(tau / 3)) / 60;
}

/**
 * Guides go through the raw curve: slope -1/2 through its first point, 0 through its lowest, +1/2 through its last,
 * unless a coefficient of the raw stream says better.
 */
function guides(tau: Float64Array, raw: PlainAllanPoint[], report: PlainAllan | undefined): Float64Array[] {
  const lowest = raw.reduce((a, b) => (b.deviation < a.deviation ? b : a));
  const last = raw[raw.length - 1];
  const found = (symbol: string) => report?.coefficients.find((c) => c.symbol === symbol && c.identified === VALUE && c.value > 0)?.value;
  const n = found('N') ?? (raw[0].deviation * Math.sqrt(raw[0].tau)) / 60;
  const b = found('B') ?? lowest.deviation / B_FACTOR;
  const k = found('K') ?? (60 * last.deviation) / Math.sqrt(last.tau / 3);
  return [tau.map((t) => deviationOf('N', n, t)), tau.map((t) => deviationOf('B', b, t)), tau.map((t) => deviationOf('K', k, t))];
}

export function allanFigure(raw: PlainAllan | undefined, compensated: PlainAllan | undefined, span: AllanSpan): AllanFigure | undefined {
  const rawPoints = pointsOf(raw, span);
  const leftPoints = pointsOf(compensated, span);
  if (rawPoints.length < 2) return undefined;
  const tau = Float64Array.from([...new Set([...rawPoints, ...leftPoints].map((p) => p.tau))].sort((a, b) => a - b));
  const on = (points: PlainAllanPoint[], of: (p: PlainAllanPoint) => number) => {
    const known = new Map(points.map((p) => [p.tau, of(p)]));
    return tau.map((t) => known.get(t) ?? NaN);
  };
  const curve = (points: PlainAllanPoint[]) => [on(points, (p) => p.lower), on(points, (p) => p.upper), on(points, (p) => p.deviation)];
  const all = [...rawPoints, ...leftPoints].map((p) => p.deviation);
  const x: Range = [tau[0] / 1.15, tau[tau.length - 1] * 1.15];
  const y: Range = [Math.min(...all) / 2.2, Math.max(...all) * 2.2];
  return { columns: [tau, ...curve(rawPoints), ...curve(leftPoints), ...guides(tau, rawPoints, raw)], x, y };
}

/** The point nearest to a minute, and not farther off than a factor of 1.5. */
export function minutePoint(report: PlainAllan | undefined, span: AllanSpan): PlainAllanPoint | undefined {
  const distance = (p: PlainAllanPoint) => Math.abs(Math.log(p.tau / 60));
  const best = pointsOf(report, span).reduce<PlainAllanPoint | undefined>((a, b) => (a && distance(a) <= distance(b) ? a : b), undefined);
  return best && distance(best) < Math.log(1.5) ? best : undefined;
}
