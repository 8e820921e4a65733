// SPDX-License-Identifier: Apache-2.0
// What the gateway sends, as plain values: Protobuf in, no state.
import { fromBinary } from '@bufbuild/protobuf';
import type { Timestamp } from '@bufbuild/protobuf/wkt';
import {
  AllanReportSchema,
  EventSchema,
  FleetSchema,
  GatewayStatusSchema,
  HistorySchema,
  NavigationStateSchema,
  RateComparison_Obstacle,
  ServiceStatusSchema,
  ThermalCoverageSchema,
  TwinReportSchema,
  type AllanPoint,
  type AxisState,
  type RateComparison,
  type SampleBatch,
  type Vector3,
} from './generated/telemetry_pb.ts';
import type { HistoryColumns, SampleColumns } from './lib/gyro_store.ts';
import type { Comparison, Obstacle } from './lib/comparison.ts';
import type { AxisLive, GyroSummary, PlainAllan, PlainAllanPoint, PlainCoverage, PlainEvent, PlainGateway, PlainNavigation, PlainStatus, PlainTwin } from './lib/messages.ts';

const milliseconds = (stamp: Timestamp | undefined) => (stamp ? Number(stamp.seconds) * 1e3 + stamp.nanos * 1e-6 : NaN);
const nanoseconds = (stamp: Timestamp | undefined) => (stamp ? stamp.seconds * 1_000_000_000n + BigInt(stamp.nanos) : 0n);
const vector = (v: Vector3 | undefined) => (v ? [v.x, v.y, v.z] : [NaN, NaN, NaN]);

/** The newest of an axis in a batch. */
export function axisLive(batch: SampleBatch, a: number): AxisLive {
  const state: AxisState | undefined = [batch.x, batch.y, batch.z][a];
  const last = batch.sensorTimeNs.length - 1;
  const raw = [batch.rawXDegH, batch.rawYDegH, batch.rawZDegH][a];
  const compensated = [batch.compensatedXDegH, batch.compensatedYDegH, batch.compensatedZDegH][a];
  return {
    mode: state?.mode ?? 0,
    reason: state?.reason ?? '',
    rung: state?.rung ?? '',
    valid: (batch.validity & (1 << a)) !== 0,
    clipped: (batch.validity & (1 << (8 + a))) !== 0,
    raw: raw[last] ?? NaN,
    compensated: compensated[last] ?? NaN,
    sigma: vector(batch.driftSigmaDegH)[a],
  };
}

/** Rates of a batch, deg/h. */
export function sampleColumns(batch: SampleBatch): SampleColumns {
  return {
    timeNs: batch.sensorTimeNs,
    raw: [batch.rawXDegH, batch.rawYDegH, batch.rawZDegH],
    compensated: [batch.compensatedXDegH, batch.compensatedYDegH, batch.compensatedZDegH],
    sigma: vector(batch.driftSigmaDegH),
  };
}

/** Rows of one second, deg/h and degC. */
export function decodeHistory(payload: Uint8Array): { gyro: number; rows: HistoryColumns } {
  const rows = fromBinary(HistorySchema, payload);
  return {
    gyro: rows.gyroId,
    rows: {
      isBacklog: rows.isBacklog,
      timeNs: rows.sensorTimeNs,
      axes: rows.axes.map((axis) => ({
        rawLow: axis.rawMinDegH,
        rawMean: axis.rawMeanDegH,
        rawHigh: axis.rawMaxDegH,
        compensatedLow: axis.compensatedMinDegH,
        compensatedMean: axis.compensatedMeanDegH,
        compensatedHigh: axis.compensatedMaxDegH,
        drift: axis.driftMeanDegH,
        sigma: axis.driftSigmaDegH,
        reference: axis.referenceMeanDegH,
        mode: axis.mode,
      })),
      probes: rows.probes.map((p) => ({ probe: p.probe, temperature: p.temperatureDegc, rate: p.rateDegcPerMin })),
    },
  };
}

const OBSTACLES: Record<RateComparison_Obstacle, Obstacle | undefined> = {
  [RateComparison_Obstacle.NO_OBSTACLE]: undefined,
  [RateComparison_Obstacle.NOTHING_TAKEN_OFF]: 'passthrough',
  [RateComparison_Obstacle.MEAN_HELD]: 'holding',
  [RateComparison_Obstacle.MOTION]: 'motion',
  [RateComparison_Obstacle.TOO_SHORT]: 'short',
};

function comparison(c: RateComparison | undefined): Comparison {
  const obstacle = c ? OBSTACLES[c.obstacle] : 'unknown';
  if (!c || obstacle) return { obstacle: obstacle ?? 'unknown' };
  return { blocks: c.blocks, raw: c.rawDegH, compensated: c.compensatedDegH, against: c.againstReference ? 'reference' : 'rest' };
}

/** `arrivedMs`: wall time here. The pace is not in it. */
export function decodeFleet(payload: Uint8Array, arrivedMs: number): GyroSummary[] {
  return fromBinary(FleetSchema, payload).gyros.map((g) => ({
    gyro: g.gyroId,
    arrivedMs,
    ageS: g.ageS,
    sensorTimeS: Number(g.sensorTimeNs) * 1e-9,
    sampleIntervalS: g.sampleIntervalS,
    missing: Number(g.missing),
    blockS: g.blockS,
    pace: NaN,
    axes: g.axes.map((axis, a) => ({
      valid: (g.validity & (1 << a)) !== 0,
      mode: axis.state?.mode ?? 0,
      reason: axis.state?.reason ?? '',
      comparison: comparison(axis.comparison),
      harmed: axis.worseThanRaw,
    })),
  }));
}

const allanPoint = (p: AllanPoint): PlainAllanPoint => ({ tau: p.tauS, deviation: p.deviationDegH, lower: p.lowerDegH, upper: p.upperDegH });

export function decodeAllan(payload: Uint8Array): PlainAllan {
  const r = fromBinary(AllanReportSchema, payload);
  return {
    gyro: r.gyroId,
    axis: r.axis,
    stream: r.stream,
    samples: Number(r.samples),
    sampleIntervalS: r.sampleIntervalS,
    windowS: r.windowS,
    sinceStart: r.sinceStart.map(allanPoint),
    rolling: r.rolling.map(allanPoint),
    coefficients: r.coefficients.map(({ symbol, unit, value, lower, upper, identified }) => ({ symbol, unit, value, lower, upper, identified })),
    reducedChiSquare: r.reducedChiSquare,
    gaps: Number(r.gaps),
    missing: Number(r.missing),
    stuck: r.stuck,
    noiseGrown: r.noiseGrown,
    worseThanRaw: r.worseThanRaw,
    blockS: r.blockS,
    blockCount: Number(r.blockCount),
    sinceStartBlockStd: r.sinceStartBlockStdDegH,
    rollingBlockStd: r.rollingBlockStdDegH,
  };
}

export function decodeNavigation(payload: Uint8Array): { sensorNs: bigint; state: PlainNavigation } {
  const n = fromBinary(NavigationStateSchema, payload);
  const sensorNs = nanoseconds(n.timestamp);
  return {
    sensorNs,
    state: {
      gyro: n.gyroId,
      stream: n.stream,
      sensorTimeS: Number(sensorNs) * 1e-9,
      phase: n.phase,
      atRest: n.atRest,
      heading: n.headingDeg,
      roll: n.rollDeg,
      pitch: n.pitchDeg,
      headingSigma: n.headingSigmaDeg,
      headingError: n.headingErrorDeg,
      attitudeError: n.attitudeErrorDeg,
      bias: vector(n.gyroBiasDegH),
      biasSigma: vector(n.gyroBiasSigmaDegH),
      updates: Number(n.updates),
      rejected: Number(n.rejected),
    },
  };
}

export function decodeTwin(payload: Uint8Array): PlainTwin {
  const t = fromBinary(TwinReportSchema, payload);
  return {
    gyro: t.gyroId,
    axis: t.axis,
    verdict: t.verdict,
    model: t.model,
    record: t.record,
    text: t.text,
    nextExperiment: t.nextExperiment,
    heldOut: t.heldOut,
    before: t.beforeRmsDegH,
    after: t.afterRmsDegH,
    noiseFloor: t.noiseFloorRmsDegH,
    atMs: Number(t.wallTimeNs) * 1e-6,
    effects: t.effects.map(({ name, alternatives, probability, shareOfGap }) => ({
      name,
      alternatives: alternatives.map((other) => ({ name: other.name, probability: other.probability })),
      probability,
      shareOfGap,
    })),
    input: t.input,
    time: Float64Array.from(t.timeS),
    measured: Float64Array.from(t.measuredDegH),
    twin: Float64Array.from(t.twinDegH),
    repaired: Float64Array.from(t.repairedDegH),
    inputValue: Float64Array.from(t.inputValue),
  };
}

export function decodeCoverage(payload: Uint8Array): PlainCoverage {
  const c = fromBinary(ThermalCoverageSchema, payload);
  return {
    gyro: c.gyroId,
    step: c.stepDegc,
    edges: c.rateEdgesDegcPerMin,
    cells: c.cells.map(({ fromDegc, rate, labels }) => ({ from: fromDegc, rate, labels })),
  };
}

export function decodeStatus(payload: Uint8Array): PlainStatus {
  const s = fromBinary(ServiceStatusSchema, payload);
  return {
    service: s.service,
    host: s.host,
    processId: s.processId,
    state: s.state,
    uptimeS: s.uptimeS,
    summary: s.summary,
    alive: s.alive,
    atMs: milliseconds(s.timestamp),
    metrics: s.metrics.map(({ name, unit, value }) => ({ name, unit, value })),
  };
}

export function decodeEvent(payload: Uint8Array): PlainEvent {
  const e = fromBinary(EventSchema, payload);
  return {
    key: `${e.timestamp?.seconds}.${e.timestamp?.nanos} ${e.service} ${e.code} ${e.count} ${e.text}`,
    atMs: milliseconds(e.timestamp),
    service: e.service,
    code: e.code,
    text: e.text,
    severity: e.severity,
    gyro: e.gyroId,
    count: Number(e.count),
    sensorTimeS: Number(e.sensorTimeNs) * 1e-9,
  };
}

export function decodeGateway(payload: Uint8Array): PlainGateway {
  const g = fromBinary(GatewayStatusSchema, payload);
  return {
    atMs: milliseconds(g.timestamp),
    version: g.version,
    domain: g.domain,
    clients: g.clients,
    framesSent: Number(g.framesSent),
    framesDropped: Number(g.framesDropped),
    droppedOfAll: Number(g.droppedOfAll),
    queueFill: g.queueFill,
    endpoints: g.endpoints.map((p) => ({
      topic: p.topic,
      isWriter: p.isWriter,
      process: p.process,
      reliability: p.reliability,
      durability: p.durability,
      ownership: p.ownership,
      ownershipStrength: p.ownershipStrength,
      liveliness: p.liveliness,
      leaseS: p.leaseS,
      deadlineS: p.deadlineS,
      problem: p.problem,
    })),
  };
}
