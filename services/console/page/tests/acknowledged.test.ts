// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { NOTHING_SEEN, acknowledged, isSeen, storeSeen, storedSeen, unseenText } from '../src/lib/acknowledged.ts';
import { foldDeaths } from '../src/lib/events.ts';
import type { PlainEvent } from '../src/lib/messages.ts';

const STALE: PlainEvent = { key: 'a', atMs: 10_000, service: 'compensation', code: 'input_stale', text: '', severity: 2, gyro: 1, count: 1, sensorTimeS: 0 };
const LOST: PlainEvent = { ...STALE, key: 'b', code: 'missing_sample', severity: 1 };
const NOTE: PlainEvent = { ...STALE, key: 'c', code: 'mode_x', severity: 0 };

function memory(): () => Pick<Storage, 'getItem' | 'setItem'> {
  const kept = new Map<string, string>();
  return () => ({ getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => void kept.set(key, value) });
}

test('the badge counts errors and losses, and nothing else', () => {
  assert.equal(unseenText(foldDeaths([STALE, LOST, NOTE]), NOTHING_SEEN), '1 error, 1 loss');
  assert.equal(unseenText(foldDeaths([{ ...STALE, key: 'd' }, STALE]), NOTHING_SEEN), '2 errors');
  assert.equal(unseenText(foldDeaths([NOTE]), NOTHING_SEEN), '');
});

test('what was acknowledged counts no more, what comes after it does', () => {
  const seen = acknowledged([STALE, LOST, NOTE], NOTHING_SEEN, 20_000);
  assert.equal(unseenText(foldDeaths([STALE, LOST, NOTE]), seen), '');
  const again = { ...STALE, key: 'e', atMs: 10_001 };
  assert.equal(unseenText(foldDeaths([again, STALE, LOST]), seen), '1 error');
});

test('a service whose clock is behind is heard all the same', () => {
  const seen = acknowledged([STALE], NOTHING_SEEN, 20_000);
  const behind = { ...STALE, key: 'f', service: 'gyro_publisher', atMs: 5000 };
  assert.equal(unseenText(foldDeaths([STALE, behind]), seen), '1 error');
});

test('a death that one more reports later has been seen', () => {
  const death = { ...STALE, code: 'liveliness_lost', severity: 1, text: 'topic event: gyro_publisher (pid 42) wrote nothing' };
  const seen = acknowledged([death], NOTHING_SEEN, 20_000);
  const [row, ...others] = foldDeaths([{ ...death, key: 'g', service: 'console', code: 'peer_lost', atMs: 12_000 }, death]);
  assert.deepEqual(others, []);
  assert.ok(isSeen(row, seen));
  const [again] = foldDeaths([{ ...death, key: 'h', atMs: 14_000 }, death]);
  assert.ok(!isSeen(again, seen), 'the same observer has lost it a second time');
});

test('a reload keeps what was acknowledged, another run of the gateway does not', () => {
  const store = memory();
  const seen = acknowledged([STALE], NOTHING_SEEN, 20_000);
  storeSeen(store, 'run 1', seen);
  assert.deepEqual(storedSeen(store, 'run 1'), seen);
  assert.deepEqual(storedSeen(store, 'run 2'), NOTHING_SEEN);
});

test('where the browser keeps nothing, or something else, nothing has been seen', () => {
  const forbidden = () => {
    throw new Error('forbidden');
  };
  storeSeen(forbidden, 'run 1', NOTHING_SEEN);
  assert.deepEqual(storedSeen(forbidden, 'run 1'), NOTHING_SEEN);
  for (const text of ['', '7', '{"session":"run 1"}', '{"session":"run 1","services":3,"lossesMs":null}']) {
    assert.deepEqual(storedSeen(() => ({ getItem: () => text, setItem: () => {} }), 'run 1'), NOTHING_SEEN, text);
  }
});
