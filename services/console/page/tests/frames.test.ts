// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { backoffMs, gyroTopic, parseBinary, parseText, serviceCall, subscribe } from '../src/lib/frames.ts';

test('a message frame gives its subscription, log time and payload', () => {
  const bytes = Uint8Array.from([1, 0x2a, 1, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1, 0xaa, 0xbb]);
  const frame = parseBinary(bytes.buffer);
  assert.equal(frame.op, 'message');
  assert.ok(frame.op === 'message');
  assert.equal(frame.subscription, 0x12a);
  assert.equal(frame.logTimeNs, 0x0102030405060708n);
  assert.deepEqual([...frame.payload], [0xaa, 0xbb]);
});

test('a service call is laid out as the protocol says', () => {
  const bytes = serviceCall(3, 258, 'protobuf', Uint8Array.from([9, 8]));
  assert.deepEqual([...bytes], [2, 3, 0, 0, 0, 2, 1, 0, 0, 8, 0, 0, 0, ...new TextEncoder().encode('protobuf'), 9, 8]);
});

test('a response frame gives its call and payload', () => {
  const bytes = serviceCall(3, 7, 'protobuf', Uint8Array.from([5])); // same layout but for the operation
  bytes[0] = 3;
  const frame = parseBinary(bytes.buffer);
  assert.ok(frame.op === 'response');
  assert.deepEqual([frame.service, frame.call, frame.encoding, [...frame.payload]], [3, 7, 'protobuf', [5]]);
});

test('a cut, empty, or unknown frame is passed over', () => {
  assert.equal(parseBinary(new ArrayBuffer(0)).op, 'other');
  assert.equal(parseBinary(Uint8Array.from([1, 2, 3]).buffer).op, 'other');
  assert.equal(parseBinary(Uint8Array.from([9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).buffer).op, 'other');
  const long = serviceCall(1, 1, 'protobuf', new Uint8Array(0));
  long[0] = 3;
  new DataView(long.buffer).setUint32(9, 4_000_000_000, true);
  assert.equal(parseBinary(long.buffer).op, 'other');
  assert.equal(parseText('{').op, 'other');
  assert.equal(parseText('[1]').op, 'other');
  assert.equal(parseText('{"op":"parameterValues"}').op, 'other');
  assert.equal(parseText('{"op":"status","level":1,"message":"m"}').op, 'status');
});

test('a subscription names channel and id', () => {
  assert.deepEqual(JSON.parse(subscribe([{ id: 4, channelId: 9 }])), { op: 'subscribe', subscriptions: [{ id: 4, channelId: 9 }] });
});

test('a topic of a gyro gives its id', () => {
  assert.deepEqual(gyroTopic('/gyro_12/samples'), { gyro: 12, what: 'samples' });
  assert.equal(gyroTopic('/gateway'), undefined);
  assert.equal(gyroTopic('/gyro_x/samples'), undefined);
});

test('waiting doubles up to eight seconds', () => {
  assert.deepEqual([0, 1, 2, 5, 6, 1000].map(backoffMs), [250, 500, 1000, 8000, 8000, 8000]);
});
