// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { grownLosses } from '../src/lib/facts.ts';
import { PaceMeter } from '../src/lib/pace.ts';

const SILENCE_MS = 2500;

test('a loss has the time at which the count grew here, and a late answer that fills a hole is none', () => {
  const before = grownLosses(undefined, 7, 1000);
  assert.deepEqual(before, { missing: 7, sinceMs: 1000, seen: false });
  const grown = grownLosses(before, 9, 2000);
  assert.deepEqual(grown, { missing: 9, sinceMs: 2000, seen: true });
  assert.deepEqual(grownLosses(grown, 9, 3000), grown);
  assert.deepEqual(grownLosses(grown, 8, 3000), { missing: 8, sinceMs: 2000, seen: true });
});

test('the pace is of the last seconds, unknown at first and after a step back of sensor time', () => {
  const meter = new PaceMeter();
  assert.ok(Number.isNaN(meter.mark(0, 100, SILENCE_MS)));
  assert.equal(meter.mark(2000, 120, SILENCE_MS), 10);
  for (let s = 3; s <= 20; ++s) meter.mark(1000 * s, 120 + (s - 2), SILENCE_MS);
  assert.equal(meter.mark(21_000, 139, SILENCE_MS), 1);
  assert.ok(Number.isNaN(meter.mark(22_000, 0, SILENCE_MS)));
  assert.equal(meter.mark(24_000, 4, SILENCE_MS), 2);
});

test('a silence is no slow pace: one who was held up and goes on as before is measured anew', () => {
  const meter = new PaceMeter();
  for (let s = 0; s <= 5; ++s) meter.mark(1000 * s, s, SILENCE_MS);
  assert.ok(Number.isNaN(meter.mark(12_000, 5.1, SILENCE_MS)), 'sensor time stood still for seven seconds');
  assert.equal(meter.mark(14_000, 7.1, SILENCE_MS), 1);
});
