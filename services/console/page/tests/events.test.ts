// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { eventText, eventTitle, foldDeaths, liveness } from '../src/lib/events.ts';
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

test('what is reported of the input has a name in words', () => {
  assert.equal(eventTitle('double_correction'), 'Corrected twice');
  assert.equal(eventTitle('polarity_reversed'), 'Wrong sign');
  assert.equal(eventTitle('clocks_disagree'), 'Clocks disagree');
  assert.equal(eventTitle('liveliness_lost'), 'Fell silent');
  assert.equal(eventTitle('mode_x'), '', 'its text begins with the axis');
});

test('the reason of a mode is in words, other texts are as they came', () => {
  const mode = { ...EVENT, code: 'mode_x', text: 'axis x: frozen (polarity_reversed)' };
  assert.match(eventText(mode), /^axis x: frozen \(it turns the other way round than/);
  assert.equal(eventText({ ...mode, text: 'axis x: learning (none)' }), 'axis x: learning');
  assert.equal(eventText({ ...EVENT, text: 'is late (by 2 s)' }), 'is late (by 2 s)');
});

test('a death that three report is one event, with who reported it', () => {
  const lost = { ...EVENT, code: 'peer_lost', text: 'gyro_publisher (pid 42) is silent; it did not say that it ends' };
  const silent = { ...EVENT, code: 'deadline_missed', text: 'topic angular_rate: gyro_publisher (pid 42) sent nothing for more than 100 ms' };
  const events = [
    { ...lost, key: 'a', service: 'console', atMs: 20_000 },
    { ...lost, key: 'b', service: 'allan_monitor', atMs: 19_500 },
    { ...EVENT, key: 'c', atMs: 15_000 },
    { ...silent, key: 'd', service: 'compensation', atMs: 10_000 },
  ];
  const rows = foldDeaths(events);
  assert.deepEqual(rows.map((e) => e.key), ['a', 'c']);
  assert.deepEqual(rows[0].observers, ['console', 'allan_monitor', 'compensation']);
});

test('before the middleware gives the dead up, what its status and topics miss is one event too', () => {
  const silent = (key: string, service: string, topic: string) => ({ ...EVENT, key, service, code: 'liveliness_lost', text: `topic ${topic}: thermal_publisher (pid 8051) wrote nothing for 2000 ms` });
  const missed = { ...EVENT, key: 'd', service: 'console', code: 'deadline_missed', text: 'topic service_status: thermal_publisher (pid 8051) sent nothing for more than 1000 ms' };
  const rows = foldDeaths([silent('a', 'compensation', 'replay_progress'), silent('b', 'console', 'service_status'), silent('c', 'gyro_publisher', 'replay_progress'), missed]);
  assert.deepEqual(rows.map((e) => e.key), ['a']);
  assert.deepEqual(rows[0].observers, ['compensation', 'console', 'gyro_publisher']);
});

test('a process that was only held up tells of its own silence: the same one', () => {
  const text = 'topic service_status: gyro_publisher (pid 42) wrote nothing for 2000 ms';
  const own = { ...EVENT, key: 'b', atMs: 104_000, service: 'gyro_publisher', code: 'liveliness_lost', text: 'topic service_status: this writer wrote nothing for 2000 ms: readers take it for gone' };
  const others = { ...EVENT, key: 'a', service: 'console', code: 'liveliness_lost', text };
  assert.deepEqual(foldDeaths([own, others]).map((e) => e.observers), [['gyro_publisher', 'console']]);
  assert.deepEqual(foldDeaths([{ ...own, service: 'recorder' }, others]).map((e) => e.key), ['b', 'a'], "somebody else's silence");
});

test('another process, a much earlier loss and a mere silence are no part of a death', () => {
  const lost = { ...EVENT, code: 'peer_lost', text: 'compensation (pid 42) is silent' };
  const events = [
    { ...lost, key: 'a', atMs: 200_000 },
    { ...lost, key: 'b', text: 'compensation (pid 43) is silent', atMs: 199_000 },
    { ...EVENT, key: 'c', code: 'deadline_missed', text: 'topic event: recorder (pid 9) sent nothing', atMs: 198_000 },
    { ...lost, key: 'd', atMs: 100_000 },
  ];
  assert.deepEqual(foldDeaths(events).map((e) => e.key), ['a', 'b', 'c', 'd']);
});

test('an orderly end is no loss', () => {
  assert.equal(liveness({ ...STATUS, alive: false, state: 'stopping' }), 'ended');
  assert.equal(liveness({ ...STATUS, alive: false }), 'gone');
  assert.equal(liveness(STATUS), 'running');
});
