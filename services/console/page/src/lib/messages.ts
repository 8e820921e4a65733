// SPDX-License-Identifier: Apache-2.0
// What page and worker say to each other. The worker holds socket, decoder and rings; the page draws.
import type { AxisFacts, Link } from './verdict.ts';

export interface AxisLive {
  mode: number;
  reason: string;
  rung: string;
  valid: boolean;
  clipped: boolean;
  raw: number; // newest sample, deg/h
  compensated: number;
  sigma: number;
}

/** The newest of a gyro, a few times a second. */
export interface Live {
  gyro: number;
  arrivedMs: number; // wall time (performance.timeOrigin + now) at which the newest batch came
  sensorTimeS: number;
  sampleIntervalS: number;
  sequence: number;
  missing: number;
  modelEpoch: number;
  instance: number;
  answered: number;
  pace: number; // sensor seconds a second, over the last seconds; NaN while unknown
  behindS: number; // how long it waited for the link or this browser
  latencyP50Ms: number; // the source's write to decoded here; NaN where unknown
  latencyP99Ms: number;
  latencyCount: number;
  axes: AxisLive[];
  rows: { samples: number; history: number };
  probes: string[];
}

/** What the gateway says of every gyro, once a second. */
export interface GyroSummary {
  gyro: number;
  arrivedMs: number; // wall time here
  ageS: number; // since the newest sample reached the gateway, by its clock
  sensorTimeS: number;
  sampleIntervalS: number;
  missing: number;
  blockS: number; // of the means that are compared
  pace: number; // sensor seconds a second; NaN while unknown
  axes: AxisFacts[];
}

export interface PlainMetric {
  name: string;
  unit: string;
  value: number;
}

export interface PlainStatus {
  service: string;
  host: string;
  processId: number;
  state: string;
  uptimeS: number;
  summary: string;
  alive: boolean;
  atMs: number;
  metrics: PlainMetric[];
}

export interface PlainEvent {
  key: string;
  atMs: number;
  service: string;
  code: string;
  text: string;
  severity: number;
  gyro: number;
  count: number;
  sensorTimeS: number;
}

export interface PlainAllanPoint {
  tau: number;
  deviation: number;
  lower: number;
  upper: number;
}

export interface PlainCoefficient {
  symbol: string;
  unit: string;
  value: number;
  lower: number;
  upper: number;
  identified: number; // idl/proto/telemetry.proto
}

export interface PlainAllan {
  gyro: number;
  axis: number;
  stream: number;
  samples: number;
  sampleIntervalS: number;
  windowS: number;
  sinceStart: PlainAllanPoint[];
  rolling: PlainAllanPoint[];
  coefficients: PlainCoefficient[];
  reducedChiSquare: number;
  gaps: number;
  missing: number;
  stuck: boolean;
  noiseGrown: boolean;
  worseThanRaw: boolean;
  blockS: number;
  blockCount: number;
  sinceStartBlockStd: number;
  rollingBlockStd: number;
}

export interface PlainCoverage {
  gyro: number;
  step: number; // degC
  edges: number[]; // degC/min, ascending
  cells: { from: number; rate: number; labels: number[] }[]; // degC; edges that lie below; by axis
}

export interface PlainTwin {
  gyro: number;
  axis: number;
  verdict: string;
  model: string;
  record: string;
  text: string;
  nextExperiment: string;
  heldOut: boolean;
  before: number;
  after: number;
  noiseFloor: number;
  atMs: number;
  effects: { name: string; alternatives: { name: string; probability: number }[]; probability: number; shareOfGap: number }[];
  input: string; // what the missing effect follows; empty: nothing known
  time: Float64Array;
  measured: Float64Array;
  twin: Float64Array;
  repaired: Float64Array;
  inputValue: Float64Array;
}

export interface PlainNavigation {
  gyro: number;
  stream: number;
  sensorTimeS: number;
  phase: number;
  atRest: boolean;
  heading: number;
  roll: number;
  pitch: number;
  headingSigma: number;
  headingError: number;
  attitudeError: number;
  bias: number[];
  biasSigma: number[];
  updates: number;
  rejected: number;
}

export interface PlainEndpoint {
  topic: string;
  isWriter: boolean;
  process: string;
  reliability: string;
  durability: string;
  ownership: string;
  ownershipStrength: number;
  liveliness: string;
  leaseS: number;
  deadlineS: number;
  problem: string;
}

export interface PlainGateway {
  atMs: number; // wall time there
  version: string;
  domain: number;
  clients: number;
  framesSent: number;
  framesDropped: number;
  droppedOfAll: number;
  queueFill: number;
  endpoints: PlainEndpoint[];
}

/** Series of a view; times in seconds of sensor time. Rate columns: raw x y z, compensated x y z. */
export interface View {
  id: number;
  gyro: number;
  from: number;
  to: number;
  bucketS: number;
  time: Float64Array;
  low: Float64Array[];
  mean: Float64Array[];
  high: Float64Array[];
  drift: Float64Array[]; // x y z
  sigma: Float64Array[];
  slowTime: Float64Array; // of what follows, from the one-second rows
  residual: Float64Array[]; // compensated - reference, x y z
  temperature: Float64Array[]; // each probe
  temperatureRate: Float64Array[];
  probes: string[];
  hasReference: boolean;
  oldest: number;
  newest: number;
}

export interface ViewRequest {
  id: number;
  follow: boolean; // the window ends at the newest sample
  to: number; // otherwise here
  span: number;
  buckets: number;
  averageS: number; // at least; 0: as many as fit
}

/** What is kept of a navigation filter's state, deg. */
export type Angles = Pick<PlainNavigation, 'headingError' | 'attitudeError' | 'roll' | 'pitch'>;

/** Each angle of the streams raw, compensated, reference. */
export type AttitudeSeries = { gyro: number; time: Float64Array } & Record<keyof Angles, Float64Array[]>;

export type ToWorker =
  | { type: 'connect'; url: string }
  | { type: 'select'; gyro: number }
  | { type: 'view'; request: ViewRequest }
  | { type: 'attitude'; points: number }
  | { type: 'visible'; visible: boolean }
  | { type: 'csv'; from: number; to: number }
  | { type: 'command'; id: number; service: string; name: string; argument: string }
  | { type: 'retry' };

/** Of a command; `unanswered`: nobody said whether it was done. */
export type Outcome = 'done' | 'refused' | 'unanswered';

export type FromWorker =
  | { type: 'link'; link: Link; retryAtMs: number; server: string; session: string; canCommand: boolean; sinceMs: number; refused: boolean }
  | { type: 'gyros'; gyros: number[]; selected: number }
  | { type: 'tick' }
  | { type: 'live'; live: Live }
  | { type: 'fleet'; fleet: GyroSummary[] }
  | { type: 'view'; view: View }
  | { type: 'attitude'; attitude: AttitudeSeries }
  | { type: 'status'; services: PlainStatus[] }
  | { type: 'events'; events: PlainEvent[] }
  | { type: 'allan'; report: PlainAllan }
  | { type: 'twin'; report: PlainTwin }
  | { type: 'coverage'; coverage: PlainCoverage }
  | { type: 'navigation'; state: PlainNavigation }
  | { type: 'gateway'; gateway: PlainGateway }
  | { type: 'notice'; severity: number; text: string }
  | { type: 'csv'; blob: Blob; rows: number; name: string }
  | { type: 'reply'; id: number; outcome: Outcome; text: string; modelEpoch: number };
