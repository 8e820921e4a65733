// SPDX-License-Identifier: Apache-2.0
// What the page shows, as the worker tells it.
import { NOTHING_SEEN, acknowledged, isSeen, storeSeen, storedSeen, unseenText } from './lib/acknowledged.ts';
import { goneText } from './lib/cause.ts';
import { foldDeaths, type FoldedEvent } from './lib/events.ts';
import { factsOf, grownLosses, type Losses } from './lib/facts.ts';
import type {
  AttitudeSeries,
  FromWorker,
  GyroSummary,
  Live,
  Outcome,
  PlainAllan,
  PlainCoverage,
  PlainEvent,
  PlainGateway,
  PlainNavigation,
  PlainStatus,
  PlainTwin,
  ToWorker,
  View,
} from './lib/messages.ts';
import { banner, isPast, sharesText, verdict, type Facts, type Link } from './lib/verdict.ts';

export const TABS = ['live', 'allan', 'health', 'twin', 'navigation', 'events'] as const;
export type Tab = (typeof TABS)[number];

export type AxisChoice = 'all' | 0 | 1 | 2;

const MOST_EVENTS = 2000;
const CLOCK_MS = 1000;

interface Reply {
  outcome: Outcome;
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
  private fleet = $state.raw<GyroSummary[]>([]);
  private losses = $state.raw<ReadonlyMap<number, Losses>>(new Map());
  private gatewayAheadMs = $state(0);
  services = $state.raw<PlainStatus[]>([]);
  events = $state.raw<PlainEvent[]>([]);
  rows = $derived(foldDeaths(this.events));
  private session = '';
  private seen = $state.raw(NOTHING_SEEN);
  allan = $state.raw<Record<string, PlainAllan>>({});
  twins = $state.raw<Record<string, PlainTwin>>({});
  coverages = $state.raw<Record<number, PlainCoverage>>({});
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
        this.noteLosses([message.live]);
        this.live = message.live;
        this.nowMs = this.clock();
        break;
      case 'fleet':
        this.noteLosses(message.fleet);
        this.fleet = message.fleet;
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
      case 'coverage':
        this.coverages = { ...this.coverages, [message.coverage.gyro]: message.coverage };
        break;
      case 'navigation':
        this.navigation = { ...this.navigation, [`${message.state.gyro}/${message.state.stream}`]: message.state };
        break;
      case 'attitude':
        this.attitude = message.attitude;
        break;
      case 'gateway':
        this.gateway = message.gateway;
        this.gatewayAheadMs = message.gateway.atMs - this.clock();
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

  private noteLosses(of: { gyro: number; missing: number }[]): void {
    if (of.every(({ gyro, missing }) => this.losses.get(gyro)?.missing === missing)) return;
    const losses = new Map(this.losses);
    for (const { gyro, missing } of of) losses.set(gyro, grownLosses(losses.get(gyro), missing, this.clock()));
    this.losses = losses;
  }

  private beSession(session: string): void {
    if (session === this.session) return;
    this.session = session;
    // What services said stands only while the gateway knows whether they live; it tells again what of it is of now.
    this.allan = {};
    this.navigation = {};
    this.coverages = {};
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

  /** What the compensation that answers, or did last, says of the chosen gyro. */
  private answering(): PlainStatus | undefined {
    const instance = this.live?.instance;
    const number = instance === undefined ? '(/\\d+)?' : instance > 0 ? `/${instance}` : '';
    const name = new RegExp(`^compensation${number}:${this.selected}$`);
    return this.services.find((s) => name.test(s.service));
  }

  /** Who makes the forecast of an axis; empty where the compensation doesn't say. */
  shares(axis: number): string {
    return sharesText(this.answering()?.metrics ?? [], axis);
  }

  /** What the model was last given. */
  temperatureLast(): { degc: number; degcPerMin: number } {
    const metrics = this.answering()?.metrics ?? [];
    const value = (name: string) => metrics.find((m) => m.name === name)?.value ?? NaN;
    return { degc: value('temperature'), degcPerMin: value('temperature_rate') };
  }

  /** It is no longer of now. */
  get temperatureIsPast(): boolean {
    return this.past || this.answering()?.alive === false;
  }

  report(axis: number, stream: number): PlainAllan | undefined {
    return this.allan[`${this.selected}/${axis}/${stream}`];
  }

  factsOf(gyro: number): Facts {
    const { link, linkSinceMs, nowMs, gatewayAheadMs, live, fleet, losses, services } = this;
    const acknowledgedMs = this.seen.lossesMs;
    const dropped = this.gateway?.framesDropped ?? 0;
    return factsOf({ link, linkSinceMs, nowMs, gatewayAheadMs, live, fleet, losses, acknowledgedMs, services, dropped }, gyro);
  }

  readonly facts = $derived.by(() => this.factsOf(this.selected));
  readonly verdict = $derived(verdict(this.facts));
  readonly banner = $derived(banner(this.facts));

  get ageS(): number {
    return this.facts.ageS;
  }

  /** How long ago something was by the gateway's clock; this browser's may be set to anything. */
  agoS(atMs: number): number {
    return Math.max(0, this.nowMs + this.gatewayAheadMs - atMs) / 1000;
  }

  /** Why what a service said is no longer of now, else empty. */
  gone(service: string): string {
    return goneText(this.services, service, this.nowMs + this.gatewayAheadMs);
  }

  /** What is shown is no longer of now. */
  get past(): boolean {
    return this.facts.present && isPast(this.facts);
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
