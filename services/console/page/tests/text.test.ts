// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { addressees, COMMANDS, injectionArgument, publishers } from '../src/lib/commands.ts';
import { seconds } from '../src/lib/csv.ts';
import { duration, figure, microseconds, niceRange, steadyRange, timeLabel, timeTicks } from '../src/lib/scale.ts';

test('figures have the digits asked for', () => {
  assert.deepEqual([0.0036, 1.117, 308.2, -0.5, 0, NaN, 1.2e-7].map((v) => figure(v)), ['0.00360', '1.12', '308', '−0.500', '0', '–', '1.20e−7']);
});

test('times on the axis are elapsed, or UTC for Unix time', () => {
  assert.equal(timeLabel(3723, 1), '1:02:03');
  assert.equal(timeLabel(3723.45, 0.05), '1:02:03.45');
  assert.equal(timeLabel(1_700_000_000, 1), '22:13:20');
  assert.equal(timeLabel(59.9999, 0.1), '0:01:00.0');
});

test('ticks lie on a grid people count in', () => {
  assert.deepEqual(timeTicks(7, 68, 5).ticks, [15, 30, 45, 60]);
  assert.ok(timeTicks(0, 43200, 6).ticks.length <= 7);
});

test('a range holds what it must and does not breathe', () => {
  const range = niceRange(-1.3, 4.2);
  assert.ok(range[0] <= -1.3 && range[1] >= 4.2);
  assert.equal(steadyRange(range, -1.2, 4.1), range);
  assert.notEqual(steadyRange(range, -0.1, 0.1), range);
  assert.ok(steadyRange(range, -1.3, 9)[1] >= 9);
  assert.deepEqual(niceRange(Infinity, -Infinity), [-1, 1]);
});

test('decimal seconds keep every nanosecond', () => {
  assert.equal(seconds(1_700_000_000_000_000_001n), '1700000000.000000001');
  assert.equal(seconds(-1_500_000_000n), '-1.500000000');
});

test('times for people', () => {
  assert.deepEqual([0.42, 60, 600, 18000].map(duration), ['0.42 s', '60 s', '10 min', '5.0 h']);
  assert.deepEqual([62, 1500, 2.5e6].map(microseconds), ['62.0 µs', '1.50 ms', '2.50 s']);
});

test('an injection is spelt kind:axis:magnitude:seconds', () => {
  assert.equal(injectionArgument({ kind: 'step', axis: 'x', magnitude: 5, seconds: 60 }), 'step:x:5:60');
  assert.equal(injectionArgument({ kind: 'noise', axis: 'y', magnitude: 0.5, seconds: 1.5 }), 'noise:y:0.5:1.5');
  assert.equal(injectionArgument({ kind: 'stuck', axis: 'z', magnitude: 3, seconds: 2 }), 'stuck:z:0:2');
  assert.equal(injectionArgument({ kind: 'gap', axis: 'x', magnitude: 3, seconds: 2 }), 'gap:xyz:0:2');
  assert.equal(injectionArgument({ kind: 'clear', axis: 'x', magnitude: 3, seconds: 2 }), 'clear');
});

test('a command goes to the services that are there', () => {
  const freeze = COMMANDS.find((c) => c.name === 'freeze');
  assert.ok(freeze);
  assert.deepEqual(addressees(freeze, ['compensation/0', 'compensation/1', 'compensation/0:1', 'allan_monitor']), ['compensation/0', 'compensation/1']);
  assert.deepEqual(addressees(freeze, []), ['compensation']);
  assert.deepEqual(publishers(['gyro_publisher', 'compensation']), ['gyro_publisher']);
});
