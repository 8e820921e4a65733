// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { allanFigure, coefficient, deviationOf, minutePoint, whyWithheld } from '../src/lib/allan_figure.ts';
import { LatencyWindow } from '../src/lib/latency_window.ts';
import type { PlainAllan } from '../src/lib/messages.ts';

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
