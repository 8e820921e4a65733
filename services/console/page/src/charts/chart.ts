// SPDX-License-Identifier: Apache-2.0
// uPlot with this page's look: own paths that keep holes open, bands, direct labels at the lines' ends.
import uPlot from 'uplot';
import { timeLabel, timeTicks, type Range } from '../lib/scale.ts';
import { colour, type Colour } from './palette.ts';

export interface Trace {
  label: string;
  colour: Colour;
  kind: 'line' | 'band' | 'points'; // a band fills between this series (low) and the next (high), which has kind 'edge'
  width?: number;
  dash?: number[];
  bridge?: number; // a hole this long on the x axis is drawn over
  tag?: string; // written at the line's end; the label without
}

export interface ChartOptions {
  traces: (Trace | 'edge')[];
  x: 'time' | 'log' | 'linear';
  y: 'linear' | 'log';
  syncKey?: string;
  height: number;
  tags: boolean;
  onSelect?: (from: number, to: number) => void;
  onCursor?: (index: number | null) => void;
}

type Map1 = (value: number) => number;

function toPixels(u: uPlot, key: 'x' | 'y'): Map1 {
  const scale = u.scales[key];
  const log = scale.distr === 3;
  const f: Map1 = log ? Math.log10 : (v) => v;
  const low = f(scale.min ?? 0);
  const high = f(scale.max ?? 1);
  const { left, top, width, height } = u.bbox;
  return key === 'x' ? (v) => left + ((f(v) - low) / (high - low)) * width : (v) => top + ((high - f(v)) / (high - low)) * height;
}

function linePath(u: uPlot, series: number, bridge: number): uPlot.Series.Paths {
  const path = new Path2D();
  const x = toPixels(u, 'x');
  const y = toPixels(u, 'y');
  const xs = u.data[0];
  const ys = u.data[series];
  let last = -1; // the newest known value
  for (let i = 0; i < xs.length; ++i) {
    const py = y(ys[i] as number);
    if (!Number.isFinite(py)) continue;
    if (last >= 0 && (last === i - 1 || xs[i] - xs[last] <= bridge)) path.lineTo(x(xs[i]), py);
    else path.moveTo(x(xs[i]), py);
    last = i;
  }
  return { stroke: path };
}

function pointPath(u: uPlot, series: number): uPlot.Series.Paths {
  const path = new Path2D();
  const x = toPixels(u, 'x');
  const y = toPixels(u, 'y');
  const radius = 2.2 * devicePixelRatio;
  u.data[0].forEach((t, i) => {
    const px = x(t);
    const py = y(u.data[series][i] as number);
    if (!Number.isFinite(py)) return;
    path.moveTo(px + radius, py);
    path.arc(px, py, radius, 0, 2 * Math.PI);
  });
  return { stroke: path, fill: path };
}

function bandPath(u: uPlot, series: number): uPlot.Series.Paths {
  const path = new Path2D();
  const x = toPixels(u, 'x');
  const y = toPixels(u, 'y');
  const xs = u.data[0];
  const low = u.data[series] as ArrayLike<number>;
  const high = u.data[series + 1] as ArrayLike<number>;
  let begin = -1;
  const close = (end: number) => {
    if (begin < 0) return;
    path.moveTo(x(xs[begin]), y(low[begin]));
    for (let i = begin + 1; i < end; ++i) path.lineTo(x(xs[i]), y(low[i]));
    for (let i = end - 1; i >= begin; --i) path.lineTo(x(xs[i]), y(high[i]));
    path.closePath();
    begin = -1;
  };
  for (let i = 0; i < xs.length; ++i) {
    const known = Number.isFinite(y(low[i])) && Number.isFinite(y(high[i]));
    if (known && begin < 0) begin = i;
    if (!known) close(i);
  }
  close(xs.length);
  return { stroke: null, fill: path };
}

const nothing: uPlot.Series.PathBuilder = () => null;

function series(trace: Trace | 'edge'): uPlot.Series {
  if (trace === 'edge') return { paths: nothing, points: { show: false } };
  const common: uPlot.Series = { label: trace.label, points: { show: false }, spanGaps: true };
  const stroke = () => colour(trace.colour);
  if (trace.kind === 'band') return { ...common, fill: stroke, paths: bandPath };
  if (trace.kind === 'points') return { ...common, stroke, fill: stroke, width: 1, paths: pointPath };
  return { ...common, stroke, width: trace.width ?? 1.5, dash: trace.dash, paths: (u, s) => linePath(u, s, trace.bridge ?? 0) };
}

const FONT = '11px system-ui, sans-serif';

function timeAxis(): uPlot.Axis {
  return {
    stroke: () => colour('axis'),
    font: FONT,
    grid: { stroke: () => colour('grid'), width: 1 },
    ticks: { stroke: () => colour('grid'), width: 1, size: 4 },
    size: 24,
    gap: 3,
    space: 90,
    splits: (u, _axis, min, max) => timeTicks(min, max, Math.max(2, u.bbox.width / devicePixelRatio / 90)).ticks,
    values: (u, splits) => {
      const { min = 0, max = 1 } = u.scales.x;
      const { step } = timeTicks(min ?? 0, max ?? 1, Math.max(2, u.bbox.width / devicePixelRatio / 90));
      return splits.map((s) => timeLabel(s, step));
    },
  };
}

function decades(min: number, max: number): number[] {
  const ticks: number[] = [];
  for (let e = Math.ceil(Math.log10(min) - 1e-9); e <= Math.log10(max) + 1e-9; ++e) ticks.push(10 ** e);
  return ticks;
}

function logTicks(min: number, max: number): number[] {
  const whole = decades(min, max);
  if (whole.length >= 3) return whole;
  const ticks: number[] = [];
  for (let e = Math.floor(Math.log10(min)); e <= Math.ceil(Math.log10(max)); ++e) {
    for (const m of [1, 2, 5]) if (m * 10 ** e >= min * 0.999 && m * 10 ** e <= max * 1.001) ticks.push(m * 10 ** e);
  }
  return ticks;
}

const SUPERSCRIPT: Record<string, string> = { '-': '⁻', '0': '⁰', '1': '¹', '2': '²', '3': '³', '4': '⁴', '5': '⁵', '6': '⁶', '7': '⁷', '8': '⁸', '9': '⁹' };

export function logLabel(value: number): string {
  const e = Math.round(Math.log10(value));
  const whole = Math.abs(value / 10 ** e - 1) < 1e-6;
  if (!whole || Math.abs(e) <= 3) return String(Number(value.toPrecision(2)));
  return '10' + [...String(e)].map((c) => SUPERSCRIPT[c]).join('');
}

/** Decimals that tell multiples of `step` apart. */
function decimals(step: number): number {
  for (let d = 0; d < 9; ++d) if (Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) < 1e-6) return d;
  return 9;
}

function valueAxis(log: boolean, side: 'x' | 'y'): uPlot.Axis {
  return {
    stroke: () => colour('axis'),
    font: FONT,
    grid: { stroke: () => colour('grid'), width: 1 },
    ticks: { stroke: () => colour('grid'), width: 1, size: 4 },
    size: side === 'y' ? (_u, labels) => Math.max(54, 12 + 6.6 * Math.max(0, ...(labels ?? []).map((label) => label.length))) : 24, // charts above each other line up
    gap: 3,
    space: side === 'y' ? 22 : 60,
    ...(log
      ? { splits: (_u, _a, min, max) => logTicks(min, max), values: (_u, splits) => splits.map(logLabel), filter: (_u, splits) => splits }
      : { values: (_u, splits, _a, _space, step) => splits.map((v) => (v === 0 ? '0' : v.toFixed(decimals(step)).replace('-', '−'))) }),
  };
}

function tagWidth(traces: (Trace | 'edge')[]): number {
  const longest = Math.max(0, ...traces.map((t) => (t === 'edge' || t.kind !== 'line' ? 0 : (t.tag ?? t.label).length)));
  return Math.min(130, Math.max(56, 12 + 7.2 * longest)); // charts above each other line up
}

/** Labels at the lines' ends, pushed apart: nobody has to tell lines by colour. */
function drawTags(u: uPlot, traces: (Trace | 'edge')[]): void {
  const y = toPixels(u, 'y');
  const { left, top, width, height } = u.bbox;
  const ratio = devicePixelRatio;
  const step = 13 * ratio;
  const tags: { text: string; at: number; colour: string }[] = [];
  traces.forEach((trace, i) => {
    if (trace === 'edge' || trace.kind !== 'line') return;
    const values = u.data[i + 1];
    for (let k = values.length - 1; k >= 0; --k) {
      const at = y(values[k] as number);
      if (!Number.isFinite(at)) continue;
      tags.push({ text: trace.tag ?? trace.label, at: Math.min(top + height - step / 2, Math.max(top + step / 2, at)), colour: colour(trace.colour) });
      break;
    }
  });
  tags.sort((a, b) => a.at - b.at);
  for (let i = 1; i < tags.length; ++i) tags[i].at = Math.max(tags[i].at, tags[i - 1].at + step);
  for (let i = tags.length - 1; i >= 0; --i) {
    const limit = i === tags.length - 1 ? top + height - step / 2 : tags[i + 1].at - step;
    tags[i].at = Math.min(tags[i].at, limit);
  }
  const ctx = u.ctx;
  ctx.save();
  ctx.font = `600 ${11 * ratio}px system-ui, sans-serif`;
  ctx.textAlign = 'left';
  ctx.textBaseline = 'middle';
  for (const tag of tags) {
    ctx.lineWidth = 3.5 * ratio;
    ctx.lineJoin = 'round';
    ctx.strokeStyle = colour('surface');
    ctx.strokeText(tag.text, left + width + 4 * ratio, tag.at);
    ctx.fillStyle = tag.colour;
    ctx.fillText(tag.text, left + width + 4 * ratio, tag.at);
  }
  ctx.restore();
}

/** Charts share the cursor, and no drag: what one marks would be stretched by another that shows an older window. */
const isOfCursor = (type: string): boolean => type === 'mousemove' || type === 'mouseleave';

export class Chart {
  readonly plot: uPlot;
  private readonly options: ChartOptions;
  frames = 0;

  constructor(target: HTMLElement, options: ChartOptions) {
    this.options = options;
    const opts: uPlot.Options = {
      width: Math.max(120, target.clientWidth),
      height: options.height,
      legend: { show: false },
      padding: [6, options.tags ? tagWidth(options.traces) : 8, 0, 0],
      scales: {
        x: { time: false, auto: false, distr: options.x === 'log' ? 3 : 1, range: (_u, min, max) => [min, max] },
        y: { auto: false, distr: options.y === 'log' ? 3 : 1, range: (_u, min, max) => [min, max] },
      },
      axes: [options.x === 'time' ? timeAxis() : valueAxis(options.x === 'log', 'x'), valueAxis(options.y === 'log', 'y')],
      series: [{}, ...options.traces.map(series)],
      cursor: {
        sync: options.syncKey ? { key: options.syncKey, setSeries: false, filters: { pub: isOfCursor, sub: isOfCursor } } : undefined,
        drag: { x: options.onSelect !== undefined, y: false, setScale: false },
        points: { size: 5 },
        bind: { dblclick: () => null }, // what resets is the window, not one chart
        y: false,
      },
      hooks: {
        setSelect: [
          (u) => {
            if (u.select.width < 4 || !options.onSelect) return;
            const from = u.posToVal(Math.max(0, u.select.left), 'x');
            const to = u.posToVal(Math.min(u.over.clientWidth, u.select.left + u.select.width), 'x');
            u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
            options.onSelect(from, to);
          },
        ],
        setCursor: [(u) => options.onCursor?.(u.cursor.left !== undefined && u.cursor.left >= 0 ? (u.cursor.idx ?? null) : null)],
        draw: [
          (u) => {
            this.frames += 1;
            if (options.tags) drawTags(u, options.traces);
          },
        ],
      },
    };
    this.plot = new uPlot(opts, [[], ...options.traces.map(() => [])], target);
    // A drag that strays above or below the chart goes on where the mouse is; uPlot alone would mark all up to the chart's end.
    const { over } = this.plot;
    if (options.onSelect) over.addEventListener('pointerdown', (e) => over.setPointerCapture(e.pointerId));
  }

  /** `columns`: x, then one for each trace. */
  show(columns: ArrayLike<number>[], x: Range, y: Range): void {
    this.plot.batch(() => {
      this.plot.setData(columns as unknown as uPlot.AlignedData, false);
      this.plot.setScale('x', { min: x[0], max: x[1] });
      this.plot.setScale('y', { min: y[0], max: y[1] });
    });
  }

  resize(width: number, height = this.options.height): void {
    this.options.height = height;
    if (width > 0) this.plot.setSize({ width, height });
  }

  redraw(): void {
    this.plot.redraw(false, true);
  }

  destroy(): void {
    this.plot.destroy();
  }
}

