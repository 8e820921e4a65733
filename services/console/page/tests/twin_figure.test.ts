// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { PlainTwin } from '../src/lib/messages.ts';
import { candidates, residualFigure } from '../src/lib/twin_figure.ts';

const column = (of: (i: number) => number, count = 200) => Float64Array.from({ length: count }, (_, i) => of(i));
const input = (i: number) => Math.sin(i / 7); // in no order
const REPORT: PlainTwin = {
  gyro: 1,
  axis: 0,
  verdict: 'effect_named',
  model: '',
  record: '',
  text: '',
  nextExperiment: '',
  heldOut: true,
  before: 1,
  after: 0.1,
  noiseFloor: 0.1,
  atMs: 0,
  effects: [],
  input: 'magnetic_y (µT)',
  time: column((i) => 60 * i),
  measured: column((i) => 5 + 3 * input(i)),
  twin: column(() => 5),
  repaired: column((i) => 5 + 2.9 * input(i)),
  inputValue: column(input),
};

test('the residual stands over its input, ascending, with what the repair explains', () => {
  const shown = residualFigure(REPORT);
  assert.ok(shown);
  const [x, left, explained] = shown.columns;
  assert.ok(x.every((v, i) => i === 0 || v >= x[i - 1]));
  const known = (values: Float64Array) => [...values.keys()].filter((i) => Number.isFinite(values[i]));
  assert.equal(known(left).length, 200);
  for (const i of known(left)) assert.ok(Math.abs(left[i] - 3 * x[i]) < 1e-12);
  // Of a straight line the mean in a bin lies on it, whatever the bin's width.
  assert.ok(known(explained).length > 20);
  for (const i of known(explained)) assert.ok(Math.abs(explained[i] - 2.9 * x[i]) < 1e-12);
  assert.ok(shown.x[0] <= x[0] && shown.x[1] >= x[x.length - 1]);
  assert.ok(shown.y[0] <= -2.9 && shown.y[1] >= 2.9);
});

test('an input that takes few values, or one, is shown all the same', () => {
  for (const levels of [1, 3]) {
    const value = (i: number) => i % levels;
    const shown = residualFigure({ ...REPORT, inputValue: column(value), repaired: column((i) => 5 + value(i)) });
    assert.ok(shown);
    const explained = [...shown.columns[2]].filter((v) => Number.isFinite(v));
    assert.deepEqual(explained, [0, 1, 2].slice(0, levels));
    assert.ok(shown.x[0] < shown.x[1]);
  }
});

test('without an input, or where its values are not known, there is no such figure', () => {
  assert.equal(residualFigure({ ...REPORT, input: '' }), undefined);
  assert.equal(residualFigure({ ...REPORT, inputValue: column(() => NaN) }), undefined);
  assert.equal(residualFigure({ ...REPORT, inputValue: new Float64Array(0) }), undefined);
});

test('candidates are the named effect and those that explain nearly as well', () => {
  const effect = { name: 'shupe', probability: 0.9, shareOfGap: 1, alternatives: [{ name: 'coil_lag', probability: 0.07 }] };
  assert.deepEqual(candidates(effect), [
    { name: 'shupe', probability: 0.9, isNamed: true },
    { name: 'coil_lag', probability: 0.07, isNamed: false },
  ]);
});
