// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { GyroStore, type AxisColumns } from '../src/lib/gyro_store.ts';

const RATE = 100;
const EPOCH = 1_700_000_000_123_456_789n; // a sensor time of Unix size keeps its nanoseconds

function addSamples(store: GyroStore, fromS: number, seconds: number): void {
  const count = seconds * RATE;
  const timeNs = Array.from({ length: count }, (_, i) => EPOCH + BigInt(Math.round((fromS + i / RATE) * 1e9)));
  const flat = (v: number) => new Array<number>(count).fill(v);
  store.sampleIntervalS = 1 / RATE;
  store.addSamples({ timeNs, raw: [flat(3), flat(2), flat(1)], compensated: [flat(0.5), flat(0.25), flat(0)], sigma: [0.1, 0.2, NaN] });
}

function addHistory(store: GyroStore, fromS: number, seconds: number, isBacklog: boolean, reference = NaN): void {
  const flat = (v: number) => new Array<number>(seconds).fill(v);
  const axis: AxisColumns = {
    rawLow: flat(-9),
    rawMean: flat(3),
    rawHigh: flat(9),
    compensatedLow: flat(-5),
    compensatedMean: flat(0.5),
    compensatedHigh: flat(5),
    drift: flat(2.5),
    sigma: flat(0.1),
    reference: flat(reference),
    mode: new Uint8Array(seconds).fill(1),
  };
  store.addHistory({
    isBacklog,
    timeNs: Array.from({ length: seconds }, (_, i) => EPOCH + BigInt(fromS + i) * 1_000_000_000n),
    axes: [axis, axis, axis],
    probes: [{ probe: 'coil', temperature: flat(20), rate: flat(0.5) }],
  });
}

const whole = { id: 1, follow: true, to: 0, span: 100, buckets: 400, averageS: 0 };

test('a window is seconds first and full rate after, without a hole between', () => {
  const store = new GyroStore(1);
  addHistory(store, 0, 60, true);
  addSamples(store, 50, 20);
  const view = store.view(whole);
  assert.ok(view.mean[0].every((v) => v === 3));
  assert.ok(view.drift[0].every((v) => Math.abs(v - 2.5) < 1e-12));
  assert.ok(view.time.every((t, i) => i === 0 || t > view.time[i - 1]));
  assert.equal(view.high[0][0], 9);
  assert.equal(view.high[0].at(-1), 3);
  assert.deepEqual(view.probes, ['coil']);
});

test('what arrives again after a reconnection is not kept twice', () => {
  const store = new GyroStore(1);
  addSamples(store, 0, 10);
  addSamples(store, 9.5, 1);
  assert.equal(store.samples.size, 10.5 * RATE);
  addHistory(store, 0, 10, true);
  addHistory(store, 0, 12, true);
  assert.equal(store.history.size, 12);
});

test('what the page has outlives a gateway that has just started, whose backlog is short', () => {
  const store = new GyroStore(1);
  addHistory(store, 0, 100, true);
  addHistory(store, 100, 3, true);
  assert.equal(store.history.size, 103);
  addHistory(store, 0, 110, true);
  assert.equal(store.history.size, 110);
  addHistory(store, 0, 5, true); // begun anew
  assert.equal(store.history.size, 5);
});

test('a source that begins anew is shown anew', () => {
  const store = new GyroStore(1);
  addSamples(store, 100, 10);
  addHistory(store, 100, 10, true);
  addSamples(store, 0, 1);
  assert.equal(store.samples.size, RATE);
  assert.equal(store.history.size, 0);
});

test('the residual is known only where somebody publishes a reference', () => {
  const store = new GyroStore(1);
  addHistory(store, 0, 30, true);
  assert.equal(store.view(whole).hasReference, false);
  addHistory(store, 30, 30, false, 0.125);
  const view = store.view(whole);
  assert.equal(view.hasReference, true);
  assert.equal(view.residual[0].at(-1), 0.375);
  assert.ok(Number.isNaN(view.residual[0][0]));
});

test('the CSV holds exactly the visible rows, at full rate where they are, with all digits of time', () => {
  const store = new GyroStore(1);
  addHistory(store, 0, 60, true, 0.125);
  addSamples(store, 50, 20);
  const begin = Number(EPOCH) * 1e-9;
  const { parts, rows } = store.csv(begin + 40.5, begin + 59.9951);
  const lines = parts.join('').trimEnd().split('\n');
  const header = lines[0].split(',');
  assert.equal(rows, lines.length - 1);
  assert.ok(lines.slice(1).every((line) => line.split(',').length === header.length));
  const averaged = header.indexOf('averaged_over_s');
  const fullRate = lines.slice(1).filter((line) => line.split(',')[averaged] === '0');
  // Begin and end are double seconds of 1.7e9: one sample (10 ms) is far above their 0.24 us.
  assert.equal(fullRate.length, 10 * RATE);
  assert.equal(lines.length - 1 - fullRate.length, 9); // seconds 41 to 49
  assert.equal(fullRate[0].split(',')[0], '1700000050.123456789');
  assert.deepEqual(header.slice(0, 3), ['time_s', 'averaged_over_s', 'raw_x_deg_h']);
  assert.equal(fullRate[0].split(',')[header.indexOf('drift_x_deg_h')], '2.5');
  assert.equal(fullRate[0].split(',')[header.indexOf('reference_x_deg_h')], '0.125');
  assert.equal(fullRate[0].split(',')[header.indexOf('temperature_coil_degC')], '20');
});

test('following, the window is not longer than what there is', () => {
  const store = new GyroStore(1);
  addSamples(store, 0, 20);
  const view = store.view({ ...whole, span: 600 });
  assert.ok(Math.abs(view.to - view.from - 19.99) < 1e-3);
});

test('attitudes of the streams stand side by side at the times of the compensated one', () => {
  const store = new GyroStore(1);
  const add = (stream: number, s: number, roll: number) => store.addAttitude(stream, EPOCH + BigInt(Math.round(s * 1e9)), { headingError: NaN, attitudeError: 0, roll, pitch: -roll });
  for (let i = 0; i < 10; ++i) {
    add(1, i, i);
    add(1, i + 0.1, 99); // sooner than what is kept
    if (i < 5) add(0, i + 0.3, 10 + i);
    if (i >= 5) add(2, i, 20 + i);
  }
  const { time, roll, pitch } = store.attitudeSeries(100);
  assert.equal(time.length, 10);
  assert.deepEqual([...roll[1]], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
  assert.deepEqual([...roll[0]], [10, 11, 12, 13, 14, 14, NaN, NaN, NaN, NaN], 'nothing of a stream that ended more than a second ago');
  assert.deepEqual([...roll[2]], [NaN, NaN, NaN, NaN, NaN, 25, 26, 27, 28, 29]);
  assert.equal(pitch[1][3], -3);
  assert.equal(store.attitudeSeries(4).time.length, 4);
});
