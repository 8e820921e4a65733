// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { coverageMap } from '../src/lib/coverage.ts';
import type { PlainCoverage } from '../src/lib/messages.ts';

const EDGES = [-0.5, -0.05, 0.05, 0.5];
const of = (cells: PlainCoverage['cells']): PlainCoverage => ({ gyro: 1, step: 5, edges: EDGES, cells });
const ALL = [0, 1, 2];

test('where it is now, and whether anything was learned there, in words', () => {
  const coverage = of([
    { from: 20, rate: 2, labels: [9, 7, 8] },
    { from: 30, rate: 3, labels: [1, 1, 1] },
  ]);
  const says = (degc: number, degcPerMin: number) => coverageMap(coverage, ALL, { degc, degcPerMin })?.sentence;
  assert.equal(says(23.44, 0.01), 'Now 23.4 °C and steady: 7 labels learned there.');
  assert.equal(says(34.9, 0.05), 'Now 34.9 °C and warming: 1 label learned there.');
  assert.equal(says(7, -0.2), 'Now 7.0 °C and cooling: nothing learned there yet.');
  assert.equal(says(-12, -0.6), 'Now −12.0 °C and cooling fast: nothing learned there yet.');
  assert.equal(says(NaN, 0), 'The temperature now is not known.');
});

test('what was known last is said so, and nothing is framed', () => {
  const coverage = of([{ from: 20, rate: 2, labels: [9, 7, 8] }]);
  const map = coverageMap(coverage, ALL, { degc: 23.44, degcPerMin: 0.01 }, true);
  assert.equal(map?.sentence, 'Last known: 23.4 °C and steady: 7 labels learned there.');
  assert.equal(map?.here, undefined);
});

test('the map reaches from the lowest to the highest temperature that was learned or is now', () => {
  const map = coverageMap(of([{ from: 20, rate: 4, labels: [3, 3, 3] }]), ALL, { degc: -3, degcPerMin: -1 });
  assert.deepEqual(map?.from, [-5, 0, 5, 10, 15, 20]);
  assert.deepEqual(map.rows.map((row) => row.name), ['warming fast', 'warming', 'steady', 'cooling', 'cooling fast']);
  assert.deepEqual(map.rows[0].labels, [0, 0, 0, 0, 0, 3]);
  assert.deepEqual(map.here, { row: 4, column: 0 });
});

test('an axis that learns nothing takes nothing from those that do', () => {
  const coverage = of([{ from: 20, rate: 2, labels: [4, 0, 6] }]);
  const labels = (axes: number[]) => coverageMap(coverage, axes)?.rows[2].labels;
  assert.deepEqual(labels(ALL), [4]);
  assert.deepEqual(labels([2]), [6]);
  assert.equal(labels([1]), undefined);
});

test('without a label and without a temperature there is no map', () => {
  assert.equal(coverageMap(of([]), ALL), undefined);
  assert.equal(coverageMap(of([]), ALL, { degc: NaN, degcPerMin: NaN }), undefined);
  assert.deepEqual(coverageMap(of([]), ALL, { degc: 21, degcPerMin: 0 })?.from, [20]);
});
