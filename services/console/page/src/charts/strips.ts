// SPDX-License-Identifier: Apache-2.0
// The strip charts of the live view: which series of a view each shows, and what its range must hold.
import type { View } from '../lib/messages.ts';
import { extent, type Range } from '../lib/scale.ts';
import type { Trace } from './chart.ts';
import type { Colour } from './palette.ts';

export interface Strip {
  id: string;
  title: string;
  unit: string;
  slow: boolean; // of one-second rows
  traces: (Trace | 'edge')[];
  /** x, then one column for each trace; the envelope only where asked for */
  columns: (view: View, envelope: boolean) => Float64Array[];
  /** what the automatic range must hold; series numbers from 1 */
  fits: (envelope: boolean) => number[];
  /** what the header reads out: name and series number */
  readout: { name: string; series: number }[];
}

const unknown = (time: Float64Array): Float64Array => new Float64Array(time.length).fill(NaN);

export function rateStrip(axis: number): Strip {
  return {
    id: 'rate',
    title: 'Rate',
    unit: 'deg/h',
    slow: false,
    traces: [
      { label: 'raw, least to greatest', colour: 'raw-band', kind: 'band' },
      'edge',
      { label: 'compensated, least to greatest', colour: 'compensated-band', kind: 'band' },
      'edge',
      { label: 'raw', colour: 'raw', kind: 'line', width: 1 },
      { label: 'compensated', colour: 'compensated', kind: 'line', width: 2, tag: 'comp.' },
    ],
    columns: (v, envelope) => {
      const none = envelope ? undefined : unknown(v.time);
      const c = axis + 3;
      return [v.time, none ?? v.low[axis], none ?? v.high[axis], none ?? v.low[c], none ?? v.high[c], v.mean[axis], v.mean[c]];
    },
    fits: (envelope) => (envelope ? [1, 2, 3, 4] : [5, 6]),
    readout: [
      { name: 'raw', series: 5 },
      { name: 'comp.', series: 6 },
    ],
  };
}

export function driftStrip(axis: number): Strip {
  return {
    id: 'drift',
    title: 'Drift taken off ± 1 σ',
    unit: 'deg/h',
    slow: false,
    traces: [
      { label: '± 1 sigma', colour: 'drift-band', kind: 'band' },
      'edge',
      { label: 'drift', colour: 'drift', kind: 'line', width: 1.8 },
    ],
    columns: (v) => {
      const drift = v.drift[axis];
      const sigma = v.sigma[axis];
      return [v.time, drift.map((d, i) => d - sigma[i]), drift.map((d, i) => d + sigma[i]), drift];
    },
    fits: () => [1, 2, 3],
    readout: [{ name: 'drift', series: 3 }],
  };
}

export function residualStrip(axis: number): Strip {
  return {
    id: 'residual',
    title: 'Residual to reference',
    unit: 'deg/h',
    slow: true,
    traces: [{ label: 'residual', colour: 'residual', kind: 'line', width: 1.4, tag: 'resid.' }],
    columns: (v) => [v.slowTime, v.residual[axis]],
    fits: () => [1],
    readout: [{ name: 'residual', series: 1 }],
  };
}

const PROBE_BRIDGE_S = 60; // a slow thermometer is no hole
const DASHES: (number[] | undefined)[] = [undefined, [7, 3], [2, 3], [9, 3, 2, 3]];

function probeStrip(id: string, title: string, unit: string, probes: string[], of: (view: View) => Float64Array[]): Strip {
  return {
    id,
    title,
    unit,
    slow: true,
    traces: probes.map((probe, p) => ({ label: probe, colour: `probe-${p % 4}` as Colour, kind: 'line', width: 1.6, dash: DASHES[(p + Math.floor(p / 4)) % 4], bridge: PROBE_BRIDGE_S })),
    columns: (v) => [v.slowTime, ...probes.map((_, p) => of(v)[p] ?? unknown(v.slowTime))],
    fits: () => probes.map((_, p) => p + 1),
    readout: probes.map((probe, p) => ({ name: probe, series: p + 1 })),
  };
}

export function temperatureStrip(probes: string[]): Strip {
  return probeStrip('temperature', 'Temperature T', '°C', probes, (v) => v.temperature);
}

export function temperatureRateStrip(probes: string[]): Strip {
  return probeStrip('temperature-rate', 'Temperature rate dT/dt', '°C/min', probes, (v) => v.temperatureRate);
}

/** Least and greatest of what the automatic range must hold within the window. */
export function span(strip: Strip, columns: Float64Array[], from: number, to: number, envelope: boolean): Range {
  const range: Range = [Infinity, -Infinity];
  for (const series of strip.fits(envelope)) extent(columns[0], columns[series], from, to, range);
  if (range[0] > range[1]) for (let s = 1; s < columns.length; ++s) extent(columns[0], columns[s], from, to, range);
  return range;
}
