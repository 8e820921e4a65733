// SPDX-License-Identifier: Apache-2.0
// What the page shows, as the worker tells it.
import { NOTHING_SEEN, acknowledged, isSeen, storeSeen, storedSeen, unseenText } from './lib/acknowledged.ts';
import { correctedTwiceMs, foldDeaths, type FoldedEvent } from './lib/events.ts';
import type {
  AttitudeSeries,
  FromWorker,
  Live,
  PlainAllan,
  PlainEvent,
  PlainGateway,
  PlainNavigation,
  PlainStatus,
  PlainTwin,
  ToWorker,
  View,
} from './lib/messages.ts';
import type { Comparison } from './lib/statistics.ts';
import { isPast, isStale, sharesText, verdict, type Facts, type Link, type Verdict } from './lib/verdict.ts';

export const TABS = ['live', 'allan', 'health', 'twin', 'navigation', 'events'] as const;
export type Tab = (typeof TABS)[number];

export type AxisChoice = 'all' | 0 | 1 | 2;

const MOST_EVENTS = 2000;
const CLOCK_MS = 1000;

interface Reply {
  accepted: boolean;
  text: string;
  modelEpoch: number;
}

export class ConsoleState {
  link = $state<Link>('connecting');
  linkSinceMs = $state(Date.now());
  retryAtMs = $state(NaN);
  refused = $state(false);
  server = $state('');
  canCommand = $state(false);
  gyros = $state.raw<number[]>([]);
  selected = $state(0);
  live = $state.raw<Live | undefined>();
  private losses = $state.raw<{ gyro: number; missing: number; sinceMs: number; seen: boolean } | undefined>();
  services = $state.raw<PlainStatus[]>([]);
  events = $state.raw<PlainEvent[]>([]);
  rows = $derived(foldDeaths(this.events));
  private session = '';
  private seen = $state.raw(NOTHING_SEEN);
  allan = $state.raw<Record<string, PlainAllan>>({});
  twins = $state.raw<Record<string, PlainTwin>>({});
  navigation = $state.raw<Record<string, PlainNavigation>>({});
  gateway = $state.raw<PlainGateway | undefined>();
  attitude = $state.raw<AttitudeSeries | undefined>();
  notice = $state('');
  nowMs = $state(Date.now());
  tab = $state<Tab>('live');
  axis = $state<AxisChoice>('all');

  onView: (view: View) => void = () => {};
  onTick: () => void = () => {};
  private onReply = new Map<number, (reply: Reply) => void>();
  private nextCommand = 1;
  private eventKeys = new Set<string>();
  private readonly worker: Worker;

  constructor() {
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.take(data);
    document.addEventListener('visibilitychange', () => {
      this.ask({ type: 'visible', visible: !document.hidden });
      this.nowMs = this.clock();
    });
    setInterval(() => {
      if (!document.hidden) this.nowMs = this.clock();
    }, CLOCK_MS);
  }

  private clock(): number {
    return performance.timeOrigin + performance.now();
  }

  ask(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  private take(message: FromWorker): void {
    switch (message.type) {
      case 'tick':
        this.onTick();
        break;
      case 'view':
        this.onView(message.view);
        break;
      case 'live':
        this.noteLosses(message.live);
        this.live = message.live;
        this.nowMs = this.clock();
        break;
      case 'link':
        this.link = message.link;
        this.linkSinceMs = message.sinceMs;
        this.retryAtMs = message.retryAtMs;
        this.refused = message.refused;
        this.server = message.server;
        this.beSession(message.session);
        this.canCommand = message.canCommand;
        this.nowMs = this.clock();
        if (message.link !== 'open') this.gateway = undefined;
        break;
      case 'gyros':
        if (message.selected !== this.selected) this.live = undefined;
        this.gyros = message.gyros;
        this.selected = message.selected;
        break;
      case 'status':
        this.services = message.services.sort((a, b) => a.service.localeCompare(b.service, 'en', { numeric: true }));
        break;
      case 'events':
        this.addEvents(message.events);
        break;
      case 'allan':
        this.allan = { ...this.allan, [`${message.report.gyro}/${message.report.axis}/${message.report.stream}`]: message.report };
        break;
      case 'twin':
        this.twins = { ...this.twins, [`${message.report.gyro}/${message.report.axis}`]: message.report };
        break;
      case 'navigation':
        this.navigation = { ...this.navigation, [`${message.state.gyro}/${message.state.stream}`]: message.state };
        break;
      case 'attitude':
        this.attitude = message.attitude;
        break;
      case 'gateway':
        this.gateway = message.gateway;
        break;
      case 'notice':
        this.notice = message.text;
        break;
      case 'csv':
        this.save(message.blob, message.name, message.rows);
        break;
      case 'reply':
        this.onReply.get(message.id)?.(message);
        this.onReply.delete(message.id);
        break;
    }
  }

  /** A count that began before this page listened has no time of its own. */
  private noteLosses(live: Live): void {
    const known = this.losses?.gyro === live.gyro ? this.losses : undefined;
    if (known && live.missing === known.missing) return;
    const grew = known !== undefined && live.missing > known.missing;
    this.losses = { gyro: live.gyro, missing: live.missing, sinceMs: this.clock(), seen: grew };
  }

  private beSession(session: string): void {
    if (session === this.session) return;
    this.session = session;
    this.seen = storedSeen(() => localStorage, session);
  }

  /** Somebody has seen all errors and losses up to now. */
  acknowledge(): void {
    this.seen = acknowledged(this.events, this.seen, this.clock());
    storeSeen(() => localStorage, this.session, this.seen);
  }

  isSeen(row: FoldedEvent): boolean {
    return isSeen(row, this.seen);
  }

  get unseen(): string {
    return unseenText(this.rows, this.seen);
  }

  private addEvents(events: PlainEvent[]): void {
    const fresh = events.filter((e) => !this.eventKeys.has(e.key));
    if (fresh.length === 0) return;
    fresh.forEach((e) => this.eventKeys.add(e.key));
    const all = [...this.events, ...fresh].sort((a, b) => b.atMs - a.atMs);
    for (const old of all.slice(MOST_EVENTS)) this.eventKeys.delete(old.key);
    this.events = all.slice(0, MOST_EVENTS);
  }

  private save(blob: Blob, name: string, rows: number): void {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.notice = `${name}: ${rows} rows saved`;
  }

  select(gyro: number): void {
    this.ask({ type: 'select', gyro });
  }

  command(service: string, name: string, argument: string): Promise<Reply> {
    const id = this.nextCommand++;
    return new Promise((resolve) => {
      this.onReply.set(id, resolve);
      this.ask({ type: 'command', id, service, name, argument });
    });
  }

  metric(service: string, name: string): number {
    return this.services.find((s) => s.service === service)?.metrics.find((m) => m.name === name)?.value ?? NaN;
  }

  /** Who makes the forecast of an axis; empty where the compensation doesn't say. */
  shares(axis: number): string {
    const instance = this.live?.instance ?? 0;
    const service = `compensation${instance > 0 ? `/${instance}` : ''}:${this.selected}`;
    return sharesText(this.services.find((s) => s.service === service)?.metrics ?? [], axis);
  }

  report(axis: number, stream: number): PlainAllan | undefined {
    return this.allan[`${this.selected}/${axis}/${stream}`];
  }

  comparison(axis: number): Comparison {
    return this.live?.spread.axes[axis] ?? { obstacle: 'short' };
  }

  get ageS(): number {
    return this.live ? Math.max(0, this.nowMs - this.live.arrivedMs) / 1000 : NaN;
  }

  get finished(): boolean {
    return this.metric('gyro_publisher', 'finished') > 0;
  }

  get facts(): Facts {
    const live = this.live;
    return {
      link: this.link,
      present: live !== undefined,
      ageS: this.ageS,
      sampleIntervalS: live?.sampleIntervalS ?? NaN,
      finished: this.finished,
      pace: live?.pace ?? NaN,
      missing: live?.missing ?? 0,
      lossAgeS: (this.nowMs - (this.losses?.sinceMs ?? NaN)) / 1000,
      lossSeen: this.losses?.seen ?? false,
      lossAcknowledged: (this.losses?.sinceMs ?? NaN) <= this.seen.lossesMs,
      dropped: this.gateway?.framesDropped ?? 0,
      correctedTwiceS: (this.nowMs - correctedTwiceMs(this.events, this.services, this.selected)) / 1000,
      blockS: live?.spread.blockS ?? NaN,
      axes: [0, 1, 2].map((a) => {
        const axis = live?.axes[a];
        return {
          valid: axis?.valid ?? false,
          mode: axis?.mode ?? 0,
          reason: axis?.reason ?? '',
          comparison: this.comparison(a),
          harmed: this.report(a, 1)?.worseThanRaw ?? false,
        };
      }),
    };
  }

  get verdict(): Verdict {
    return verdict(this.facts);
  }

  /** What is shown is no longer of now. */
  get past(): boolean {
    return this.live !== undefined && isPast(this.facts);
  }

  get stale(): boolean {
    return isStale(this.facts);
  }
}

/** The socket of this page's host. A token in the page's address goes along and leaves the address bar. */
export function socketUrl(): string {
  const page = new URL(location.href);
  const token = page.searchParams.get('token');
  const url = new URL('/ws', page);
  url.protocol = page.protocol === 'https:' ? 'wss:' : 'ws:';
  if (token !== null) {
    url.searchParams.set('token', token);
    page.searchParams.delete('token');
    history.replaceState(null, '', page);
  }
  return url.href;
}
