// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharesText, verdict, type AxisFacts, type Facts } from '../src/lib/verdict.ts';

const LEARNING: AxisFacts = { valid: true, mode: 1, reason: 'none', ratio: 200 };
const GOOD: Facts = {
  link: 'open',
  heard: true,
  ageS: 0.01,
  sampleIntervalS: 0.005,
  finished: false,
  pace: 1,
  missing: 0,
  dropped: 0,
  axes: [LEARNING, LEARNING, { ...LEARNING, ratio: 308 }],
};
const onAll = (axis: Partial<AxisFacts>): Facts => ({ ...GOOD, axes: GOOD.axes.map((a) => ({ ...a, ...axis })) });

test('when all is well every answer is good', () => {
  const v = verdict(GOOD);
  assert.deepEqual([v.compensating.tone, v.better.tone, v.learning.tone, v.data.tone], ['good', 'good', 'good', 'good']);
  assert.equal(v.better.text, '200–308×');
});

test('frozen says why in plain words', () => {
  assert.match(verdict(onAll({ mode: 2, reason: 'motion' })).learning.detail, /it moves/);
  assert.equal(verdict(onAll({ mode: 2, reason: 'commanded' })).learning.text, 'Frozen');
  const mixed = [{ ...LEARNING, mode: 3, reason: 'model_worse_than_bias' }, { ...LEARNING, mode: 2, reason: 'commanded' }, { ...LEARNING, mode: 2, reason: 'commanded' }];
  assert.equal(verdict({ ...GOOD, axes: mixed }).learning.text, 'Frozen');
  assert.match(verdict({ ...GOOD, axes: [LEARNING, LEARNING, { ...LEARNING, mode: 2, reason: 'settling' }] }).learning.detail, /not on z/);
});

test('passthrough is not compensating, on one axis partly', () => {
  assert.equal(verdict(onAll({ mode: 0, reason: 'no_estimate_yet' })).compensating.text, 'Not compensating');
  const partly = verdict({ ...GOOD, axes: [LEARNING, { ...LEARNING, mode: 0, reason: 'initial_set' }, LEARNING] });
  assert.match(partly.compensating.detail, /not on y/);
});

test('a fallback compensates, the edge of what was learned is weak', () => {
  const one = (mode: number) => verdict({ ...GOOD, axes: [{ ...LEARNING, mode }, LEARNING, LEARNING] }).compensating;
  assert.equal(one(3).tone, 'good');
  assert.match(one(3).detail, /x by a simpler estimate/);
  assert.equal(one(4).tone, 'warn');
});

test('worse than raw is bad, unknown is not claimed', () => {
  assert.equal(verdict(onAll({ ratio: 0.7 })).better.tone, 'bad');
  assert.equal(verdict(onAll({ ratio: NaN })).better.text, 'Not known yet');
});

test('silence is stale, unless the source has ended', () => {
  assert.match(verdict({ ...GOOD, ageS: 3 }).data.text, /^Stale/);
  assert.equal(verdict({ ...GOOD, ageS: 3, finished: true }).data.text, 'Source has ended');
  assert.equal(verdict({ ...GOOD, ageS: 3, sampleIntervalS: 1 }).data.text, 'Live'); // twenty samples make silence
});

test('nothing is claimed of now when nothing comes', () => {
  for (const facts of [{ ...GOOD, ageS: 3 }, { ...GOOD, link: 'gone' as const }]) {
    const v = verdict(facts);
    assert.deepEqual([v.compensating.tone, v.better.tone, v.learning.tone, v.data.tone], ['idle', 'idle', 'idle', 'bad']);
    assert.match(v.compensating.detail, /last heard: Compensating/);
  }
  assert.equal(verdict({ ...GOOD, ageS: 3, finished: true }).compensating.tone, 'good');
});

test('losses and a replay are told', () => {
  assert.match(verdict({ ...GOOD, missing: 2 }).data.detail, /2 samples missing/);
  assert.match(verdict({ ...GOOD, dropped: 5 }).data.detail, /5 frames dropped/);
  assert.equal(verdict({ ...GOOD, pace: 60 }).data.text, 'Replay');
});

test('without a gyro or a gateway nothing is claimed', () => {
  assert.equal(verdict({ ...GOOD, heard: false }).data.text, 'No gyro heard');
  assert.equal(verdict({ ...GOOD, heard: false, link: 'connecting' }).data.text, 'Connecting');
  assert.equal(verdict({ ...GOOD, link: 'gone' }).data.text, 'Gateway gone');
});

test('experts with a tenth of the forecast are named, the largest first', () => {
  const metrics = [
    { name: 'share_hold_x', value: 0.04 },
    { name: 'share_online_svr_x', value: 0.3 },
    { name: 'share_lagged_x', value: 0.604 },
    { name: 'share_random_walk_y', value: 1 },
    { name: 'drift_x', value: 3 },
  ];
  assert.equal(sharesText(metrics, 0), '60 % lagged, 30 % SVR');
  assert.equal(sharesText(metrics, 1), '100 % random walk');
  assert.equal(sharesText(metrics, 2), '');
});
