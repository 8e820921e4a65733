// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { correctedTwiceMs, eventText, eventTitle } from '../src/lib/events.ts';
import type { PlainEvent, PlainStatus } from '../src/lib/messages.ts';

const EVENT: PlainEvent = {
  key: '1',
  atMs: 100_000,
  service: 'compensation',
  code: 'double_correction',
  text: '',
  severity: 1,
  gyro: 1,
  count: 1,
  sensorTimeS: 0,
};
const STATUS: PlainStatus = {
  service: 'compensation',
  host: 'h',
  processId: 7,
  state: 'running',
  uptimeS: 60,
  summary: '',
  alive: true,
  atMs: 110_000,
  metrics: [],
};

test('what is told of the input has a name in words', () => {
  assert.equal(eventTitle('double_correction'), 'Corrected twice');
  assert.equal(eventTitle('polarity_reversed'), 'Wrong sign');
  assert.equal(eventTitle('clocks_disagree'), 'clocks_disagree');
});

test('the reason of a mode is in words, other texts are as they came', () => {
  const mode = { ...EVENT, code: 'mode_x', text: 'axis x: frozen (polarity_reversed)' };
  assert.match(eventText(mode), /^axis x: frozen \(it turns the other way round than/);
  assert.equal(eventText({ ...mode, text: 'axis x: learning (none)' }), 'axis x: learning');
  assert.equal(eventText({ ...EVENT, text: 'is late (by 2 s)' }), 'is late (by 2 s)');
});

test('a double correction holds for its gyro until the compensation starts anew', () => {
  assert.equal(correctedTwiceMs([EVENT], [STATUS], 1), 100_000);
  assert.equal(correctedTwiceMs([EVENT], [STATUS], 2), NaN);
  assert.equal(correctedTwiceMs([EVENT], [{ ...STATUS, uptimeS: 5 }], 1), NaN);
});
