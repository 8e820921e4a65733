// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DelayMeter, sourceToPageMs } from '../src/lib/delay.ts';

const AHEAD = 1.7e12; // of the gateway's clock, ms
const about = (found: number, expected: number) => assert.ok(Math.abs(found - expected) <= 0.01 + 0.01 * expected, `${found}, not ${expected}`);

test('what waits is behind by how long it waited, whatever the clocks say of each other', () => {
  const meter = new DelayMeter();
  about(meter.mark(AHEAD, 100), 0);
  about(meter.mark(AHEAD + 1000, 1100), 0);
  for (let s = 1; s <= 30; ++s) about(meter.mark(AHEAD + 1000 + 500 * s, 1100 + 1000 * s), 0.5 * s); // half as fast as it is sent
  about(meter.mark(AHEAD + 31_000, 31_200), 0.1);
});

test('from source to page is what the gateway saw and what waited since, whatever the time is here', () => {
  const meter = new DelayMeter();
  const sent = (ms: number) => BigInt(AHEAD + ms) * 1_000_000n;
  const published = (ms: number) => sent(ms) - 2_500_000n;
  about(sourceToPageMs(published(0), sent(0), meter.mark(AHEAD, 7)), 2.5);
  about(sourceToPageMs(published(1000), sent(1000), meter.mark(AHEAD + 1000, 1007)), 2.5);
  about(sourceToPageMs(published(2000), sent(2000), meter.mark(AHEAD + 2000, 2507)), 502.5);
});

test('the first samples may have waited: the one that waited least counts', () => {
  const meter = new DelayMeter();
  meter.mark(AHEAD, 5000);
  about(meter.mark(AHEAD + 1000, 1500 + 4000), 0);
  about(meter.mark(AHEAD + 2000, 1500 + 6000), 1);
});

test("the gateway's clock may be set forward and back", () => {
  const meter = new DelayMeter();
  meter.mark(AHEAD, 0);
  about(meter.mark(AHEAD + 3_600_000, 1000), 0);
  about(meter.mark(AHEAD + 3_601_000, 2000), 0);
  about(meter.mark(AHEAD, 3000), 0);
  about(meter.mark(AHEAD + 1000, 9000), 5);
});

test('clocks that run apart are no delay, a link that falls behind is', () => {
  for (const apart of [-1e-4, 1e-4]) {
    const meter = new DelayMeter();
    for (let s = 0; s < 200_000; s += 10) about(meter.mark(AHEAD + 1000 * s, 1000 * s * (1 + apart)), 0);
    const now = 200_000 * (1 + apart);
    about(meter.mark(AHEAD + 1000 * 199_995, 1000 * now), 5);
  }
});
