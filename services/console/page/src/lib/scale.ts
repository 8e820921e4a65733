// SPDX-License-Identifier: Apache-2.0
// Ranges and labels of axes.

export type Range = [number, number];

/** The smallest of 1, 2, 5 x 10^n that is not below `value`. */
export function niceStep(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  return (lead <= 1.000001 ? 1 : lead <= 2.000001 ? 2 : lead <= 5.000001 ? 5 : 10) * power;
}

/** A range with round ends around [low, high], with some air. */
export function niceRange(low: number, high: number): Range {
  if (!(low <= high)) return [-1, 1];
  const span = Math.max(high - low, 1e-9 * Math.max(Math.abs(low), Math.abs(high)), 1e-9);
  const step = niceStep(span / 5);
  return [Math.floor((low - 0.06 * span) / step) * step, Math.ceil((high + 0.06 * span) / step) * step];
}

/** Grows at once, shrinks only when under 60 % of it is used: an automatic range that doesn't breathe. */
export function steadyRange(present: Range | undefined, low: number, high: number): Range {
  const wanted = niceRange(low, high);
  if (!present || !(low <= high)) return present ?? wanted;
  const fits = low >= present[0] && high <= present[1];
  return fits && wanted[1] - wanted[0] > 0.6 * (present[1] - present[0]) ? present : wanted;
}

/** Least and greatest finite value of a part of a series that lies within [from, to] of `time`. */
export function extent(time: Float64Array, values: Float64Array, from: number, to: number, into: Range): void {
  for (let i = 0; i < time.length; ++i) {
    const v = values[i];
    if (v !== v || time[i] < from || time[i] > to) continue;
    if (v < into[0]) into[0] = v;
    if (v > into[1]) into[1] = v;
  }
}

const TIME_STEPS_S = [
  0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600,
  43200,
];

/** Times on a grid people count in, at most `most` of them. */
export function timeTicks(from: number, to: number, most: number): { step: number; ticks: number[] } {
  const step = TIME_STEPS_S.find((s) => (to - from) / s <= most) ?? 86400;
  const ticks: number[] = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; ++k) ticks.push(k * step);
  return { step, ticks };
}

const UNIX_FROM_S = 1e9; // a sensor time beyond 2001 is taken for Unix time

/** Sensor time for people: UTC where its epoch is Unix's, otherwise time since the source's epoch. */
export function timeLabel(timeS: number, stepS: number): string {
  const digits = stepS >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(stepS) - 1e-9));
  const unit = 10 ** digits;
  const rounded = Math.round(timeS * unit) / unit;
  const whole = Math.floor(rounded);
  const part = digits > 0 ? (rounded - whole).toFixed(digits).slice(1) : '';
  const inDay = timeS > UNIX_FROM_S ? ((whole % 86400) + 86400) % 86400 : whole;
  const two = (v: number) => String(v).padStart(2, '0');
  const sign = inDay < 0 ? '-' : '';
  const size = Math.abs(inDay);
  const hours = Math.floor(size / 3600);
  return `${sign}${timeS > UNIX_FROM_S ? two(hours) : hours}:${two(Math.floor(size / 60) % 60)}:${two(size % 60)}${part}`;
}

export function isUnixTime(timeS: number): boolean {
  return timeS > UNIX_FROM_S;
}

/** `digits` significant digits, no exponent between 1e-4 and 1e6; a dash for what isn't known. */
export function figure(value: number | undefined, digits = 3): string {
  if (value === undefined || !Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(Math.max(0, digits - 1)).replaceAll('-', '−');
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(decimals, 12)).replace('-', '−');
}

/** Seconds for people: 0.4 s, 12 s, 4 min, 2.5 h. */
export function duration(s: number): string {
  if (!Number.isFinite(s)) return '–';
  if (s < 9.95) return `${figure(s, 2)} s`;
  if (s < 120) return `${Math.round(s)} s`;
  if (s < 7200) return `${Math.round(s / 60)} min`;
  return `${figure(s / 3600, 2)} h`;
}

/** Microseconds for people: 85 µs, 1.2 ms, 3.4 s. */
export function microseconds(us: number | undefined): string {
  if (us === undefined || !Number.isFinite(us)) return '–';
  if (Math.abs(us) < 1000) return `${figure(us, 3)} µs`;
  if (Math.abs(us) < 1e6) return `${figure(us / 1e3, 3)} ms`;
  return `${figure(us / 1e6, 3)} s`;
}

/** Age for people: 12 ms, 3.4 s, 5 min. */
export function ageText(s: number): string {
  if (!Number.isFinite(s)) return '–';
  if (s < 1) return `${Math.max(0, Math.round(s * 1000))} ms`;
  if (s < 100) return `${s.toFixed(s < 10 ? 1 : 0)} s`;
  return s < 7200 ? `${Math.round(s / 60)} min` : `${(s / 3600).toFixed(1)} h`;
}
