// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Envelope } from '../src/lib/envelope.ts';
import { Ring } from '../src/lib/ring.ts';

const ONE = { lows: [0], means: [0], highs: [0] };

function ringOf(times: number[], values: number[]): Ring {
  const ring = new Ring(times.length, 1);
  times.forEach((t, i) => (ring.columns[0][ring.open(t)] = values[i]));
  return ring;
}

test('no extreme of the samples is lost, and every mean lies between its extremes', () => {
  const count = 10_000;
  let seed = 7;
  const values = Array.from({ length: count }, () => {
    seed = (seed * 1103515245 + 12345) % 2147483648;
    return seed / 2147483648 - 0.5;
  });
  values[4321] = 99;
  values[777] = -55;
  const ring = ringOf(values.map((_, i) => i), values);
  const envelope = new Envelope(1, 512);
  envelope.add(ring, 0, count, ONE, { bucketNs: 100, longestStep: 250 });
  assert.equal(envelope.rows, 100);
  assert.equal(Math.max(...envelope.high[0].slice(0, 100)), 99);
  assert.equal(Math.min(...envelope.low[0].slice(0, 100)), -55);
  for (let i = 0; i < 100; ++i) {
    assert.ok(envelope.low[0][i] <= envelope.mean[0][i] && envelope.mean[0][i] <= envelope.high[0][i]);
    assert.equal(envelope.time[i], i * 100 + 49.5);
  }
});

test('buckets stay where they are when the window moves', () => {
  const ring = ringOf(Array.from({ length: 1000 }, (_, i) => i), Array.from({ length: 1000 }, (_, i) => Math.sin(i)));
  const a = new Envelope(1, 64);
  const b = new Envelope(1, 64);
  a.add(ring, 100, 900, ONE, { bucketNs: 50, longestStep: 200 });
  b.add(ring, 150, 950, ONE, { bucketNs: 50, longestStep: 200 });
  assert.deepEqual(a.mean[0].slice(1, 16), b.mean[0].slice(0, 15));
});

test('without buckets every row comes through as it is', () => {
  const ring = ringOf([3, 5, 9], [1, -2, 4]);
  const envelope = new Envelope(1, 8);
  envelope.add(ring, 0, 3, ONE, { bucketNs: 0, longestStep: 100 });
  assert.deepEqual([...envelope.time.slice(0, 3)], [3, 5, 9]);
  assert.deepEqual([...envelope.mean[0].slice(0, 3)], [1, -2, 4]);
});

test('a hole is one row of NaN, and an unknown value takes no part in a mean', () => {
  const ring = ringOf([0, 1, 2, 50, 51], [1, NaN, 3, 5, 7]);
  const envelope = new Envelope(1, 8);
  envelope.add(ring, 0, 5, ONE, { bucketNs: 10, longestStep: 20 });
  assert.equal(envelope.rows, 3);
  assert.equal(envelope.mean[0][0], 2);
  assert.ok(Number.isNaN(envelope.mean[0][1]));
  assert.equal(envelope.mean[0][2], 6);
});

test('more rows than there is room for are cut, not written beyond', () => {
  const ring = ringOf([0, 1, 2, 3, 4], [0, 1, 2, 3, 4]);
  const envelope = new Envelope(1, 3);
  envelope.add(ring, 0, 5, ONE, { bucketNs: 0, longestStep: 100 });
  assert.equal(envelope.rows, 3);
});
