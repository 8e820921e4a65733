// SPDX-License-Identifier: Apache-2.0
// The window of the live charts: asks the worker for a view when something changed, and hands it to the charts in the
// next animation frame. Never more than one request under way; nothing while hidden.
import type { View } from '../lib/messages.ts';
import type { ConsoleState } from '../state.svelte.ts';

export const SPANS_S = [2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 18000, 43200];
/** -1: as many as make a quiet line; 0: a pixel's. */
export const AVERAGES_S = [-1, 0, 1, 10, 60];
const QUIET_FROM_S = 30;
const QUIET_POINTS = 160;
const DEFAULT_SPAN_S = 600;
const SHORTEST_S = 0.02;
const LONGEST_S = 43_200;
const SLOWEST_REDRAW_MS = 400;

export class LiveView {
  follow = $state(true);
  span = $state(DEFAULT_SPAN_S);
  to = $state(0);
  averageS = $state(-1);
  envelope = $state(false);
  view = $state.raw<View | undefined>();
  cursor = $state<number | null>(null); // seconds of sensor time
  framesPerS = $state(0);

  private readonly console: ConsoleState;
  private readonly charts = new Set<(view: View) => void>();
  private pending = false; // a request is under way
  private wanted = false; // another is needed
  private received: View | undefined;
  private id = 0;
  private shownAt = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private drawn: number[] = [];
  pixels = 600;

  constructor(console: ConsoleState) {
    this.console = console;
    console.onTick = () => this.follow && this.soon();
    console.onView = (view) => this.take(view);
    document.addEventListener('visibilitychange', () => this.refresh());
  }

  register(show: (view: View) => void): () => void {
    this.charts.add(show);
    if (this.view) show(this.view);
    this.refresh();
    return () => this.charts.delete(show);
  }

  /** After new data: not sooner than the window moves by a pixel. */
  private soon(): void {
    if (this.timer !== undefined) return;
    const pace = this.console.live?.pace;
    const speed = pace !== undefined && Number.isFinite(pace) && pace > 0 ? pace : 1;
    const perPixel = (1000 * this.span) / this.pixels / speed;
    const wait = this.shownAt + Math.min(perPixel, SLOWEST_REDRAW_MS) - performance.now();
    if (wait <= 8) {
      this.refresh();
      return;
    }
    this.timer = setTimeout(() => {
      this.timer = undefined;
      this.refresh();
    }, wait);
  }

  private get effectiveAverageS(): number {
    if (this.averageS >= 0) return this.averageS;
    return this.span < QUIET_FROM_S ? 0 : this.span / QUIET_POINTS;
  }

  refresh(): void {
    if (document.hidden || this.charts.size === 0 || this.console.selected === 0) return;
    if (this.pending) {
      this.wanted = true;
      return;
    }
    this.pending = true;
    this.wanted = false;
    this.id += 1;
    const buckets = Math.max(100, Math.round(this.pixels));
    this.console.ask({
      type: 'view',
      request: { id: this.id, follow: this.follow, to: this.to, span: this.span, buckets, averageS: this.effectiveAverageS },
    });
  }

  private take(view: View): void {
    this.pending = false;
    if (this.view === undefined && !Number.isFinite(view.newest)) return; // nothing to draw yet; what comes ticks
    const first = this.received === undefined;
    this.received = view;
    if (first) requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    const view = this.received;
    this.received = undefined;
    if (!view) return;
    this.view = view;
    if (this.follow) this.to = view.to;
    this.charts.forEach((show) => show(view));
    const now = performance.now();
    this.shownAt = now;
    this.drawn.push(now);
    while (this.drawn.length > 0 && now - this.drawn[0] > 2000) this.drawn.shift();
    if (this.drawn.length > 1) this.framesPerS = Math.round((this.drawn.length - 1) / ((now - this.drawn[0]) * 1e-3));
    if (this.wanted) this.refresh();
  }

  // ---------------------------------------- what people do

  pause(): void {
    this.follow = !this.follow;
    this.refresh();
  }

  reset(): void {
    this.follow = true;
    this.span = DEFAULT_SPAN_S;
    this.refresh();
  }

  setSpan(span: number): void {
    const centre = this.to - this.span / 2;
    this.span = Math.min(LONGEST_S, Math.max(SHORTEST_S, span));
    if (!this.follow) this.to = centre + this.span / 2;
    this.refresh();
  }

  zoom(factor: number, about = this.to): void {
    const span = Math.min(LONGEST_S, Math.max(SHORTEST_S, this.span * factor));
    if (!this.follow) this.to = about + (this.to - about) * (span / this.span);
    this.span = span;
    this.refresh();
  }

  range(from: number, to: number): void {
    this.follow = false;
    this.to = to;
    this.span = Math.max(SHORTEST_S, to - from);
    this.refresh();
  }

  pan(share: number): void {
    this.follow = false;
    const newest = this.view?.newest ?? this.to;
    this.to = Math.min(newest + this.span / 2, this.to + share * this.span);
    this.refresh();
  }

  nextAverage(): void {
    this.averageS = AVERAGES_S[(AVERAGES_S.indexOf(this.averageS) + 1) % AVERAGES_S.length];
    this.refresh();
  }

  exportCsv(): void {
    if (this.view) this.console.ask({ type: 'csv', from: this.view.from, to: this.view.to });
  }
}
