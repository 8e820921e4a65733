// SPDX-License-Identifier: Apache-2.0
// Socket and rings, off the page's thread. Connects again by itself; what came before is kept.
import { create, fromBinary, toBinary, type DescMessage, type MessageShape } from '@bufbuild/protobuf';
import { axisLive, decodeAllan, decodeCoverage, decodeEvent, decodeFleet, decodeGateway, decodeHistory, decodeNavigation, decodeStatus, decodeTwin, sampleColumns } from './decode.ts';
import { CommandReplySchema, CommandSchema, SampleBatchSchema, type SampleBatch } from './generated/telemetry_pb.ts';
import {
  SUBPROTOCOLS,
  backoffMs,
  gyroTopic,
  parseBinary,
  parseText,
  serviceCall,
  subscribe,
  unsubscribe,
  type Channel,
  type TextFrame,
} from './lib/frames.ts';
import { DelayMeter, sourceToPageMs } from './lib/delay.ts';
import { TOLD_WITHIN_S } from './lib/facts.ts';
import { GyroStore } from './lib/gyro_store.ts';
import { LatencyWindow } from './lib/latency_window.ts';
import type { FromWorker, Outcome, PlainStatus, ToWorker } from './lib/messages.ts';
import { PaceMeter } from './lib/pace.ts';
import { staleAfterS } from './lib/verdict.ts';

const LIVE_EVERY_MS = 250;
const WATCH_EVERY_MS = 2000;
const QUIET_ROUNDS = 3; // the gateway speaks once a second
const COMMAND_WITHIN_MS = 15_000;
const LATENCY_WINDOW = 512;
const MOST_STORES = 2; // besides the selected gyro's; about 30 MB each
const WANTED = new Set(['samples', 'history', 'allan', 'navigation', 'twin', 'coverage']);
const GLOBAL = new Set(['/service_status', '/event', '/gateway', '/fleet']);

const post = (message: FromWorker, transfer: Transferable[] = []) => self.postMessage(message, { transfer });
const wallMs = () => performance.timeOrigin + performance.now();

// ---------------------------------------- what is known of gyros

const stores = new Map<number, GyroStore>();
let gyros: number[] = [];
let selected = 0;
let visible = true;

function storeOf(gyro: number): GyroStore {
  let store = stores.get(gyro);
  if (!store) stores.set(gyro, (store = new GyroStore(gyro)));
  return store;
}

let newest: { batch: SampleBatch; arrivedMs: number } | undefined;
let delayMeter = new DelayMeter(); // of a connection
let behindS = 0;
let paceMeter = new PaceMeter();
const latencies = new LatencyWindow(LATENCY_WINDOW);
let livePosted = 0;
let liveTimer: ReturnType<typeof setTimeout> | undefined;

function forgetNewest(): void {
  newest = undefined;
  paceMeter = new PaceMeter();
  latencies.clear();
}

let pace = NaN;

function postLive(): void {
  liveTimer = undefined;
  livePosted = performance.now();
  if (!newest) return;
  const { batch, arrivedMs } = newest;
  const store = storeOf(batch.gyroId);
  post({
    type: 'live',
    live: {
      gyro: batch.gyroId,
      arrivedMs,
      sensorTimeS: Number(batch.sensorTimeNs.at(-1) ?? 0n) * 1e-9,
      sampleIntervalS: batch.sampleIntervalS,
      sequence: Number(batch.sequenceNumber),
      missing: Number(batch.missing),
      modelEpoch: Number(batch.modelEpoch),
      instance: batch.instance,
      answered: batch.answered,
      pace,
      behindS,
      latencyP50Ms: latencies.quantile(0.5),
      latencyP99Ms: latencies.quantile(0.99),
      latencyCount: latencies.count,
      axes: [0, 1, 2].map((a) => axisLive(batch, a)),
      rows: { samples: store.samples.size, history: store.history.size },
      probes: [...store.probes],
    },
  });
}

function postLiveSoon(): void {
  liveTimer ??= setTimeout(postLive, Math.max(0, livePosted + LIVE_EVERY_MS - performance.now()));
}

let ticked = false;
function tick(): void {
  if (!visible || ticked) return;
  ticked = true; // until the page asks for a view
  post({ type: 'tick' });
}

function onSamples(payload: Uint8Array, logTimeNs: bigint): void {
  behindS = delayMeter.mark(Number(logTimeNs) * 1e-6, performance.now());
  const batch = fromBinary(SampleBatchSchema, payload);
  const arrivedMs = wallMs();
  const store = storeOf(batch.gyroId);
  store.sampleIntervalS = batch.sampleIntervalS;
  store.addSamples(sampleColumns(batch));
  if (batch.sensorTimeNs.length === 0) return;
  newest = { batch, arrivedMs };
  pace = paceMeter.mark(performance.now(), Number(batch.sensorTimeNs.at(-1)) * 1e-9, 1000 * staleAfterS(batch.sampleIntervalS));
  if (batch.publishUnixNs > 0n) latencies.add(sourceToPageMs(batch.publishUnixNs, logTimeNs, behindS));
  tick();
  postLiveSoon();
}

function onHistory(payload: Uint8Array): void {
  const { gyro, rows } = decodeHistory(payload);
  storeOf(gyro).addHistory(rows);
  tick();
  postLiveSoon();
}

// ---------------------------------------- small messages

const paces = new Map<number, PaceMeter>();

function onFleet(payload: Uint8Array): void {
  const fleet = decodeFleet(payload, wallMs());
  for (const gyro of fleet) {
    let meter = paces.get(gyro.gyro);
    if (!meter) paces.set(gyro.gyro, (meter = new PaceMeter()));
    gyro.pace = meter.mark(gyro.arrivedMs - gyro.ageS * 1000, gyro.sensorTimeS, 1000 * (TOLD_WITHIN_S + staleAfterS(gyro.sampleIntervalS)));
  }
  post({ type: 'fleet', fleet });
}

function onNavigation(payload: Uint8Array): void {
  const { sensorNs, state } = decodeNavigation(payload);
  storeOf(state.gyro).addAttitude(state.stream, sensorNs, state);
  post({ type: 'navigation', state });
}

const services = new Map<string, PlainStatus>();
let statusTimer: ReturnType<typeof setTimeout> | undefined;

function onStatus(payload: Uint8Array): void {
  const status = decodeStatus(payload);
  services.set(status.service, status);
  statusTimer ??= setTimeout(() => {
    statusTimer = undefined;
    post({ type: 'status', services: [...services.values()] });
  }, LIVE_EVERY_MS);
}

function forgetServices(): void {
  services.clear();
  post({ type: 'status', services: [] });
}

let pendingEvents: FromWorker & { type: 'events' } = { type: 'events', events: [] };

function onEvent(payload: Uint8Array): void {
  if (pendingEvents.events.length === 0) {
    setTimeout(() => {
      post(pendingEvents);
      pendingEvents = { type: 'events', events: [] };
    }, 50);
  }
  pendingEvents.events.push(decodeEvent(payload));
}

type Handler = (payload: Uint8Array, logTimeNs: bigint) => void;
const HANDLERS: Record<string, Handler> = {
  samples: onSamples,
  history: onHistory,
  allan: (payload) => post({ type: 'allan', report: decodeAllan(payload) }),
  navigation: onNavigation,
  twin: (payload) => post({ type: 'twin', report: decodeTwin(payload) }),
  coverage: (payload) => post({ type: 'coverage', coverage: decodeCoverage(payload) }),
  '/service_status': onStatus,
  '/event': onEvent,
  '/fleet': onFleet,
  '/gateway': (payload) => post({ type: 'gateway', gateway: decodeGateway(payload) }),
};

// ---------------------------------------- connection

let url = '';
let socket: WebSocket | undefined;
let link: (FromWorker & { type: 'link' })['link'] = 'connecting';
let linkSinceMs = wallMs();
let server = '';
let session = '';
let attempt = 0;
let retryTimer: ReturnType<typeof setTimeout> | undefined;
let retryAtMs = NaN;
let quietRounds = 0; // rounds, not time: this thread itself may have been held up
let wasOpen = false;
let refused = false; // the gateway answers, but not to this page's socket

const channels = new Map<number, Channel>();
const subscriptions = new Map<number, { channel: number; handler: Handler }>();
let nextSubscription = 1;
let commandService: number | undefined;
let nextCall = 1;
const calls = new Map<number, { id: number; timer: ReturnType<typeof setTimeout> }>();

function postLink(retryAt = NaN): void {
  post({ type: 'link', link, retryAtMs: retryAt, server, session, canCommand: commandService !== undefined, sinceMs: linkSinceMs, refused });
}

function setLink(next: typeof link, retryAt = NaN): void {
  if (next !== link) linkSinceMs = wallMs();
  link = next;
  postLink(retryAt);
}

function connect(): void {
  clearTimeout(retryTimer);
  retryTimer = undefined;
  if (!wasOpen && attempt === 0) setLink('connecting');
  const opening = new WebSocket(url, SUBPROTOCOLS);
  let opened = false;
  const before = socket; // an attempt that still waits
  socket = opening;
  before?.close();
  opening.binaryType = 'arraybuffer';
  opening.onopen = () => {
    if (socket !== opening) return;
    attempt = 0;
    wasOpen = true;
    opened = true;
    refused = false;
    quietRounds = 0;
    delayMeter = new DelayMeter();
    setLink('open');
  };
  opening.onmessage = ({ data }) => {
    if (socket !== opening) return;
    quietRounds = 0;
    if (typeof data === 'string') onText(parseText(data));
    else onBinary(data as ArrayBuffer);
  };
  opening.onclose = () => {
    if (socket !== opening) return;
    onClosed();
    if (!opened) void askWhetherRefused();
  };
}

/** A browser doesn't tell a refused socket from a dead host; a plain request does. */
async function askWhetherRefused(): Promise<void> {
  const health = new URL('/health', url.replace(/^ws/, 'http'));
  health.search = '';
  const answers = await fetch(health, { cache: 'no-store' }).then(
    () => true,
    () => false,
  );
  if (link === 'open' || answers === refused) return;
  refused = answers;
  postLink(retryAtMs);
}

function onClosed(): void {
  socket = undefined;
  channels.clear();
  subscriptions.clear();
  commandService = undefined;
  for (const call of [...calls.keys()]) answer(call, 'unanswered', 'the gateway went away before it answered');
  const wait = backoffMs(attempt++) * (0.8 + 0.4 * Math.random());
  retryAtMs = wallMs() + wait;
  setLink('gone', retryAtMs);
  retryTimer = setTimeout(connect, wait);
}

setInterval(() => {
  if (link !== 'open' || ++quietRounds <= QUIET_ROUNDS) return;
  const silent = socket;
  onClosed(); // a hung gateway closes nothing
  silent?.close();
}, WATCH_EVERY_MS);

function send(data: string | Uint8Array<ArrayBuffer>): void {
  if (socket?.readyState === WebSocket.OPEN) socket.send(data);
}

function onText(frame: TextFrame): void {
  switch (frame.op) {
    case 'serverInfo':
      server = frame.name;
      if (session !== '' && frame.sessionId !== session) forgetServices(); // of another gateway, which knows who lives
      session = frame.sessionId ?? '';
      postLink();
      break;
    case 'status':
      post({ type: 'notice', severity: frame.level, text: frame.message });
      break;
    case 'advertise':
      for (const channel of frame.channels) channels.set(channel.id, channel);
      followChannels();
      break;
    case 'unadvertise':
      for (const id of frame.channelIds) {
        channels.delete(id);
        for (const [key, s] of subscriptions) if (s.channel === id) subscriptions.delete(key);
      }
      followChannels();
      break;
    case 'advertiseServices':
      commandService = frame.services.find((s) => s.name === '/command')?.id ?? commandService;
      postLink();
      break;
    case 'unadvertiseServices':
      if (commandService !== undefined && frame.serviceIds.includes(commandService)) commandService = undefined;
      postLink();
      break;
    case 'serviceCallFailure':
      answer(frame.callId, 'unanswered', frame.message);
      break;
    case 'other':
      break;
  }
}

let decodeFailures = 0;

function onBinary(buffer: ArrayBuffer): void {
  const frame = parseBinary(buffer);
  try {
    if (frame.op === 'message') {
      subscriptions.get(frame.subscription)?.handler(frame.payload, frame.logTimeNs);
    } else if (frame.op === 'response') {
      const reply = fromBinary(CommandReplySchema, frame.payload);
      answer(frame.call, reply.accepted ? 'done' : 'refused', reply.text, Number(reply.modelEpoch));
    }
  } catch (error) {
    if (decodeFailures++ === 0) post({ type: 'notice', severity: 2, text: `a message could not be decoded: ${String(error)}` });
  }
}

/** Subscribes to what the selected gyro and the system say, and to nothing else. */
function followChannels(): void {
  const advertised = [...channels.values()].map((c) => gyroTopic(c.topic)?.gyro).filter((id) => id !== undefined);
  const known = [...new Set([...advertised, ...(selected === 0 ? [] : [selected])])].sort((a, b) => a - b);
  if (known.join() !== gyros.join() || (selected === 0 && known.length > 0)) {
    gyros = known;
    if (!gyros.includes(selected)) selected = gyros[0] ?? 0;
    post({ type: 'gyros', gyros, selected });
  }
  const wanted = new Map<number, Handler>();
  for (const channel of channels.values()) {
    const gyro = gyroTopic(channel.topic);
    if (channel.encoding !== 'protobuf') continue;
    if (gyro ? gyro.gyro === selected && WANTED.has(gyro.what) : GLOBAL.has(channel.topic)) {
      wanted.set(channel.id, HANDLERS[gyro ? gyro.what : channel.topic]);
    }
  }
  const obsolete = [...subscriptions].filter(([, s]) => !wanted.has(s.channel)).map(([id]) => id);
  if (obsolete.length > 0) send(unsubscribe(obsolete));
  obsolete.forEach((id) => subscriptions.delete(id));
  const present = new Set([...subscriptions.values()].map((s) => s.channel));
  const fresh = [...wanted].filter(([channel]) => !present.has(channel));
  const added = fresh.map(([channel, handler]) => {
    const id = nextSubscription++;
    subscriptions.set(id, { channel, handler });
    return { id, channelId: channel };
  });
  if (added.length > 0) send(subscribe(added));
}

// ---------------------------------------- commands

function encode<Desc extends DescMessage>(schema: Desc, message: MessageShape<Desc>): Uint8Array {
  return toBinary(schema, message);
}

function answer(call: number, outcome: Outcome, text: string, modelEpoch = 0): void {
  const waiting = calls.get(call);
  if (!waiting) return;
  calls.delete(call);
  clearTimeout(waiting.timer);
  post({ type: 'reply', id: waiting.id, outcome, text, modelEpoch });
}

function command(id: number, service: string, name: string, argument: string): void {
  if (commandService === undefined) {
    post({ type: 'reply', id, outcome: 'unanswered', text: 'the gateway takes no commands now', modelEpoch: 0 });
    return;
  }
  const call = nextCall++;
  const late = () => answer(call, 'unanswered', `no answer within ${COMMAND_WITHIN_MS / 1000} s`);
  calls.set(call, { id, timer: setTimeout(late, COMMAND_WITHIN_MS) });
  send(serviceCall(commandService, call, 'protobuf', encode(CommandSchema, create(CommandSchema, { service, name, argument }))));
}

// ---------------------------------------- what the page asks

function exportCsv(from: number, to: number): void {
  const { parts, rows } = storeOf(selected).csv(from, to);
  const name = `zerodrift_gyro_${selected}_${from.toFixed(0)}s_to_${to.toFixed(0)}s.csv`;
  post({ type: 'csv', blob: new Blob(parts, { type: 'text/csv' }), rows, name });
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  switch (data.type) {
    case 'connect':
      url = data.url;
      connect();
      break;
    case 'retry':
      if (link === 'gone') connect();
      break;
    case 'select':
      if (data.gyro === selected) break;
      selected = data.gyro;
      for (const gyro of [...stores.keys()].slice(0, -MOST_STORES)) if (gyro !== selected) stores.delete(gyro);
      forgetNewest();
      followChannels();
      post({ type: 'gyros', gyros, selected });
      ticked = false;
      tick();
      break;
    case 'view': {
      ticked = false;
      if (selected === 0) break;
      const view = storeOf(selected).view(data.request);
      const series = [view.low, view.mean, view.high, view.drift, view.sigma, view.residual, view.temperature, view.temperatureRate];
      post({ type: 'view', view }, [view.time.buffer, view.slowTime.buffer, ...series.flat().map((s) => s.buffer)]);
      break;
    }
    case 'attitude':
      if (selected !== 0) post({ type: 'attitude', attitude: storeOf(selected).attitudeSeries(data.points) });
      break;
    case 'visible':
      visible = data.visible;
      ticked = false;
      if (visible) tick();
      break;
    case 'csv':
      exportCsv(data.from, data.to);
      break;
    case 'command':
      command(data.id, data.service, data.name, data.argument);
      break;
  }
};
