// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { allanFigure, coefficient, deviationOf, minutePoint, whyWithheld } from '../src/lib/allan_figure.ts';
import { LatencyWindow } from '../src/lib/latency_window.ts';
import type { PlainAllan } from '../src/lib/messages.ts';
import { Ring } from '../src/lib/ring.ts';
import { blockSpread, type BlockSpread } from '../src/lib/statistics.ts';

const COLUMNS = { raw: 0, compensated: 1, reference: 2, mode: 3 };
const [PASSTHROUGH, LEARNING, FROZEN, HOLDING] = [0, 1, 2, 5];

function spreadOf(ring: Ring, blockS = 60, moves = false): BlockSpread {
  const spread = blockSpread(ring, COLUMNS, blockS, moves);
  assert.ok(!('obstacle' in spread), JSON.stringify(spread));
  return spread;
}

test('the spread of block means is that of the drift, whatever the noise within', () => {
  const ring = new Ring(1000, 4);
  ring.columns[2].fill(NaN);
  ring.columns[3].fill(LEARNING);
  for (let s = 0; s < 600; ++s) {
    const slot = ring.open(s * 1e9);
    ring.columns[0][slot] = Math.floor(s / 60) + (s % 2 === 0 ? 50 : -50); // means 0..9
    ring.columns[1][slot] = 0.01 * Math.floor(s / 60);
  }
  const spread = spreadOf(ring);
  const expected = Math.sqrt([...Array(10).keys()].reduce((sum, v) => sum + (v - 4.5) ** 2, 0) / 9);
  assert.equal(spread.blocks, 10);
  assert.ok(Math.abs(spread.raw - expected) < 1e-9);
  assert.ok(Math.abs(spread.raw / spread.compensated - 100) < 1e-6);
  assert.deepEqual(blockSpread(ring, COLUMNS, 300), { obstacle: 'short' });
});

/** Ten minutes, of which those in `moving` turn there and back; `known`: the true rate is. */
function drive(moving: number[], known: boolean): Ring {
  const ring = new Ring(1000, 4);
  for (let s = 0; s < 600; ++s) {
    const minute = Math.floor(s / 60);
    const turn = moving.includes(minute) ? 3600 * Math.sin(s / 7) : 0;
    const noise = s % 2 === 0 ? 0.1 : -0.1;
    const slot = ring.open(s * 1e9);
    ring.columns[0][slot] = turn + minute + noise;
    ring.columns[1][slot] = turn + 0.01 * minute + noise;
    ring.columns[2][slot] = known ? turn : NaN;
    ring.columns[3][slot] = moving.includes(minute) ? FROZEN : LEARNING;
  }
  return ring;
}

test('minutes of motion say nothing of drift', () => {
  const spread = spreadOf(drive([3, 4, 5, 6], false));
  assert.equal(spread.blocks, 6);
  assert.equal(spread.against, 'rest');
  assert.ok(Math.abs(spread.raw / spread.compensated - 100) < 1e-6);
  assert.deepEqual(blockSpread(drive([0, 2, 3, 4, 5, 6, 7, 9], false), COLUMNS, 60), { obstacle: 'motion' });
});

test('where it has moved all the time nothing is compared', () => {
  assert.deepEqual(blockSpread(drive([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], false), COLUMNS, 60, true), { obstacle: 'motion' });
});

test('a known true rate is taken off, and motion is as good as rest', () => {
  const spread = spreadOf(drive([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], true), 60, true);
  assert.equal(spread.blocks, 10);
  assert.equal(spread.against, 'reference');
  assert.ok(Math.abs(spread.raw / spread.compensated - 100) < 1e-3);
});

/** A start at a bias of 10 deg/h with half a minute of passthrough, half a minute held, then a model; `length` in s. */
function start(length: number): Ring {
  const ring = new Ring(1000, 4);
  ring.columns[2].fill(NaN);
  for (let s = 0; s < length; ++s) {
    const slot = ring.open(s * 1e9);
    const raw = 10 + 0.01 * s;
    ring.columns[0][slot] = raw;
    ring.columns[1][slot] = s < 30 ? raw : s < 60 ? raw - 9 : 0.0001 * s;
    ring.columns[3][slot] = s < 30 ? PASSTHROUGH : s < 60 ? HOLDING : LEARNING;
  }
  return ring;
}

test('no step from passthrough or a held mean is within the compared time', () => {
  assert.deepEqual(blockSpread(start(29), COLUMNS, 60), { obstacle: 'passthrough' });
  assert.deepEqual(blockSpread(start(59), COLUMNS, 60), { obstacle: 'holding' });
  assert.deepEqual(blockSpread(start(200), COLUMNS, 60), { obstacle: 'short' });
  const spread = spreadOf(start(600));
  assert.equal(spread.blocks, 9);
  assert.ok(Math.abs(spread.raw / spread.compensated - 100) < 2); // the first block lacks the step's second
});

test('who falls back to passthrough is compared anew', () => {
  const ring = start(600);
  for (const s of [400, 401]) ring.columns[3][ring.slot(s)] = PASSTHROUGH;
  assert.equal(spreadOf(ring).blocks, 3);
});

test('quantiles are of the newest values only', () => {
  const window = new LatencyWindow(100);
  assert.ok(Number.isNaN(window.quantile(0.5)));
  for (let i = 0; i < 1000; ++i) window.add(i);
  assert.equal(window.quantile(0.5), 949);
  assert.equal(window.quantile(1), 999);
});

const report = (deviations: number[]): PlainAllan => ({
  gyro: 1,
  axis: 0,
  stream: 0,
  samples: 1,
  sampleIntervalS: 1,
  windowS: 1,
  sinceStart: deviations.map((deviation, i) => ({ tau: 2 ** i, deviation, lower: deviation / 2, upper: deviation * 2 })),
  rolling: [],
  coefficients: [],
  reducedChiSquare: 7.31,
  gaps: 0,
  missing: 0,
  stuck: false,
  noiseGrown: false,
  worseThanRaw: false,
  blockS: 60,
  blockCount: 0,
  sinceStartBlockStd: 0,
  rollingBlockStd: 0,
});

test('the guides touch the raw curve and have their slopes', () => {
  const raw = report([8, 5, 3, 2.5, 3, 5, 8]);
  const figure = allanFigure(raw, undefined, 'since_start');
  assert.ok(figure);
  const [tau, , , , , , , white, flicker, walk] = figure.columns;
  const slope = (guide: Float64Array) => Math.log(guide[4] / guide[1]) / Math.log(tau[4] / tau[1]);
  assert.ok(Math.abs(slope(white) + 0.5) < 1e-12 && Math.abs(slope(flicker)) < 1e-12 && Math.abs(slope(walk) - 0.5) < 1e-12);
  assert.ok(Math.abs(white[0] - 8) < 1e-9 && Math.abs(flicker[0] - 2.5) < 1e-9 && Math.abs(walk[6] - 8) < 1e-9);
});

test('the coefficients have their values where IEEE 952 reads them', () => {
  assert.ok(Math.abs(deviationOf('N', 1, 3600) - 1) < 1e-12); // at one hour
  assert.ok(Math.abs(deviationOf('K', 1, 3 * 3600) - 1) < 1e-12); // at three hours
  assert.ok(Math.abs(deviationOf('B', 1, 77) - 0.664) < 1e-3);
});

test('the point near a minute is near a minute', () => {
  assert.equal(minutePoint(report([1, 1, 1, 1, 1, 1, 7]), 'since_start')?.tau, 64);
  assert.equal(minutePoint(report([1, 1, 1]), 'since_start'), undefined);
});

test('a coefficient that was withheld is no figure and has its reason', () => {
  const of = (identified: number): PlainAllan => ({ ...report([1]), coefficients: [{ symbol: 'B', unit: 'deg/h', value: 1, lower: 0, upper: 0, identified }] });
  for (const stated of [1, 2]) {
    assert.equal(coefficient(of(stated), 'B')?.value, 1);
    assert.equal(whyWithheld(of(stated), 'B'), '');
  }
  for (const not of [0, 3, 4]) assert.equal(coefficient(of(not), 'B'), undefined);
  assert.equal(whyWithheld(of(0), 'B'), '');
  assert.equal(whyWithheld(of(3), 'B'), 'no mixture of noises explains the curve (reduced chi-square 7.3)');
  assert.equal(whyWithheld(of(4), 'B'), 'a bandwidth or filter hides all that is white');
});
