// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { worstFirst } from '../src/lib/fleet.ts';
import type { Tone, Verdict } from '../src/lib/verdict.ts';

const answers = (...tones: Tone[]): Verdict => {
  const [compensating, better, learning, data] = tones.map((tone) => ({ tone, text: '', detail: '' }));
  return { compensating, better, learning, data };
};

test('gyros that need somebody come first, the others stay in their order', () => {
  const gyros = [
    { gyro: 1, verdict: answers('good', 'good', 'note', 'good') },
    { gyro: 2, verdict: answers('good', 'warn', 'good', 'good') },
    { gyro: 3, verdict: answers('idle', 'idle', 'idle', 'note') },
    { gyro: 7, verdict: answers('idle', 'warn', 'idle', 'bad') },
    { gyro: 8, verdict: answers('bad', 'idle', 'note', 'good') },
    { gyro: 9, verdict: answers('good', 'good', 'good', 'good') },
  ];
  assert.deepEqual(worstFirst(gyros).map(({ gyro }) => gyro), [7, 8, 2, 1, 3, 9]);
});
