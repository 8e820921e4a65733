// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { goneText } from '../src/lib/cause.ts';
import type { PlainStatus } from '../src/lib/messages.ts';
import { shownServices } from '../src/lib/services.ts';

function status(service: string, processId: number): PlainStatus {
  return { service, host: 'h', processId, state: 'running', uptimeS: 60, summary: '', alive: true, atMs: 0, metrics: [] };
}

const shown = (services: PlainStatus[]) => shownServices(services).map((s) => s.service);

test('a process is one row, whatever parts it tells of', () => {
  const services = [status('gyro_publisher', 5), status('gyro_publisher:1', 5), status('compensation', 7), status('compensation:1', 7),
    status('compensation:2', 7), status('compensation:latency', 7), status('compensation/2', 8), status('compensation/2:1', 8)];
  assert.deepEqual(shown(services), ['compensation', 'compensation/2', 'gyro_publisher']);
});

test('publishers of several gyros share a name and have a row each', () => {
  const services = [status('gyro_publisher', 9), status('compensation', 7)];
  for (const gyro of [10, 2, 1]) services.push(status(`gyro_publisher:${gyro}`, 100 + gyro));
  assert.deepEqual(shown(services), ['compensation', 'gyro_publisher:1', 'gyro_publisher:2', 'gyro_publisher:10']);
});

test('what a service said is of now while one of its name lives', () => {
  const dead = { ...status('navigation_filter', 7), alive: false, atMs: 1000 };
  assert.equal(goneText([], 'navigation_filter', 0), '');
  assert.equal(goneText([dead, status('navigation_filter', 8)], 'navigation_filter', 5000), '');
  assert.match(goneText([dead], 'navigation_filter', 14_000), /navigation_filter \(host h, pid 7\) is gone since 13 s/);
  assert.equal(goneText([dead], 'allan_monitor', 14_000), '');
});
