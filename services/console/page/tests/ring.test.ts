// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Ring } from '../src/lib/ring.ts';

function filled(capacity: number, count: number): Ring {
  const ring = new Ring(capacity, 1);
  for (let i = 0; i < count; ++i) ring.columns[0][ring.open(i * 10)] = i;
  return ring;
}

test('a ring keeps the newest rows, oldest first', () => {
  const ring = filled(5, 12);
  assert.equal(ring.size, 5);
  assert.deepEqual([0, 1, 2, 3, 4].map((i) => ring.columns[0][ring.slot(i)]), [7, 8, 9, 10, 11]);
  assert.equal(ring.oldest, 70);
  assert.equal(ring.newest, 110);
});

test('a row that is not newer is refused and changes nothing', () => {
  const ring = filled(5, 3);
  assert.equal(ring.open(20), -1);
  assert.equal(ring.open(NaN), -1);
  assert.equal(ring.size, 3);
  assert.equal(ring.newest, 20);
});

test('the lower bound is the first row not before a time, wherever the ring begins', () => {
  for (const count of [3, 5, 7, 12]) {
    const ring = filled(5, count);
    for (let t = -15; t < count * 10 + 15; t += 5) {
      let expected = 0;
      while (expected < ring.size && ring.timeAt(expected) < t) ++expected;
      assert.equal(ring.lowerBound(t), expected, `count ${count}, time ${t}`);
    }
  }
});

test('an empty ring has no times', () => {
  const ring = new Ring(4, 2);
  assert.ok(Number.isNaN(ring.oldest));
  assert.ok(Number.isNaN(ring.newest));
  assert.equal(ring.lowerBound(0), 0);
});

test('the nearest row is the closest in time, at both ends too', () => {
  const ring = filled(5, 7); // rows at 20, 30, 40, 50, 60
  assert.deepEqual([0, 24, 26, 40, 64, 1000].map((t) => ring.timeAt(ring.nearest(t))), [20, 20, 30, 40, 60, 60]);
  assert.equal(new Ring(5, 1).nearest(3), -1);
});
