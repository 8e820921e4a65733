// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { Comparison } from '../src/lib/comparison.ts';
import { modeText, sharesText, verdict, type AxisFacts, type Facts } from '../src/lib/verdict.ts';

const compared = (ratio: number, blocks = 100): Comparison => ({ blocks, raw: ratio, compensated: 1, against: 'rest' });
const LEARNING: AxisFacts = { valid: true, mode: 1, reason: 'none', comparison: compared(200), harmed: false };
const GOOD: Facts = {
  link: 'open',
  linkS: 600,
  known: true,
  present: true,
  ageS: 0.01,
  sampleIntervalS: 0.005,
  finished: false,
  compensationGone: false,
  pace: 1,
  behindS: 0,
  missing: 0,
  lossAgeS: 5,
  lossSeen: false,
  dropped: 0,
  blockS: 60,
  correctedTwice: [],
  causes: [],
  axes: [LEARNING, LEARNING, { ...LEARNING, comparison: compared(308) }],
};
const onAll = (axis: Partial<AxisFacts>): Facts => ({ ...GOOD, axes: GOOD.axes.map((a) => ({ ...a, ...axis })) });

test('frozen says why in plain words', () => {
  assert.match(verdict(onAll({ mode: 2, reason: 'motion' })).learning.detail, /it moves/);
  assert.equal(verdict(onAll({ mode: 2, reason: 'commanded' })).learning.text, 'Frozen');
  const mixed = [{ ...LEARNING, mode: 5, reason: 'model_worse_than_bias' }, { ...LEARNING, mode: 2, reason: 'commanded' }, { ...LEARNING, mode: 2, reason: 'commanded' }];
  assert.equal(verdict({ ...GOOD, axes: mixed }).learning.text, 'Frozen');
  assert.match(verdict({ ...GOOD, axes: [LEARNING, LEARNING, { ...LEARNING, mode: 2, reason: 'settling' }] }).learning.detail, /not on z/);
});

test('passthrough is not compensating, on one axis partly', () => {
  assert.equal(verdict(onAll({ mode: 0, reason: 'no_estimate_yet' })).compensating.text, 'Not compensating yet');
  const partly = verdict({ ...GOOD, axes: [LEARNING, { ...LEARNING, mode: 0, reason: 'initial_set' }, LEARNING] });
  assert.match(partly.compensating.detail, /not on y/);
});

test('a fallback and holding compensate, the edge of what was learned is weak', () => {
  const one = (mode: number) => verdict({ ...GOOD, axes: [{ ...LEARNING, mode }, LEARNING, LEARNING] }).compensating;
  assert.equal(one(3).tone, 'good');
  assert.match(one(3).detail, /x by a simpler estimate/);
  assert.equal(one(4).tone, 'warn');
  assert.equal(one(5).tone, 'good');
  assert.match(one(5).detail, /x by the last stationary mean/);
  assert.deepEqual([modeText(5).label, modeText(5).tone], ['Holding', 'note']);
});

test('worse than raw is bad, and the horizon is said', () => {
  const { better } = verdict(onAll({ comparison: compared(0.5) }));
  assert.equal(better.tone, 'bad');
  assert.match(better.detail, /worse than raw on x, y, z; means of 60 s over 100 min, at rest/);
});

test('the horizon says over which times each axis is compared', () => {
  const known = (blocks: number): Comparison => ({ blocks, raw: 33, compensated: 1, against: 'reference' });
  const on = (axes: Comparison[]) => verdict({ ...GOOD, axes: axes.map((comparison) => ({ ...LEARNING, comparison })) }).better.detail;
  assert.match(on([known(60), known(60), known(60)]), /means of 60 s over 60 min, against the reference$/);
  assert.match(on([compared(33), known(60), compared(33)]), /means of 60 s over 60 min, x, z at rest, y against the reference$/);
});

test('what chance could do is no verdict, until there is much of it', () => {
  assert.equal(verdict(onAll({ comparison: compared(0.4, 4) })).better.tone, 'idle');
  assert.match(verdict(onAll({ comparison: compared(0.4, 4) })).better.detail, /may be chance/);
  assert.equal(verdict(onAll({ comparison: compared(0.1, 4) })).better.tone, 'bad');
  assert.equal(verdict(onAll({ comparison: compared(1.1) })).better.tone, 'warn');
});

test('a healthy start shows nothing red', () => {
  for (const reason of ['no_estimate_yet', 'initial_set', 'motion', 'settling', 'temperature_rate_not_ready']) {
    const v = verdict(onAll({ mode: 0, reason, comparison: { obstacle: 'passthrough' } }));
    assert.deepEqual([v.compensating.tone, v.better.tone, v.learning.tone, v.data.tone], ['note', 'idle', 'note', 'good'], reason);
    assert.equal(modeText(0, reason).tone, 'note');
  }
  const held = verdict(onAll({ mode: 5, reason: 'initial_set', comparison: { obstacle: 'holding' } }));
  assert.deepEqual([held.compensating.tone, held.better.tone], ['good', 'idle']);
});

test('passthrough for a fault is bad, also beside axes that only start', () => {
  assert.equal(verdict(onAll({ mode: 0, reason: 'temperature_missing' })).compensating.tone, 'bad');
  const mixed = [{ ...LEARNING, mode: 0, reason: 'no_estimate_yet' }, { ...LEARNING, mode: 0, reason: 'invalid_input' }, LEARNING];
  const { compensating } = verdict({ ...GOOD, axes: mixed });
  assert.equal(compensating.tone, 'warn');
  assert.match(compensating.detail, /not on x, y: the raw sample was invalid/);
});

test('data are not good of an axis that is invalid', () => {
  const dead = verdict({ ...GOOD, axes: [LEARNING, LEARNING, { ...LEARNING, valid: false }] });
  assert.deepEqual([dead.data.tone, dead.data.text], ['note', 'Not of z']);
  assert.match(dead.data.detail, /z: marked invalid by the source; live, none missing/);
  assert.equal(verdict(onAll({ valid: false })).data.tone, 'bad');
});

test('nothing is claimed of now when nothing comes', () => {
  for (const facts of [{ ...GOOD, ageS: 3 }, { ...GOOD, link: 'gone' as const }]) {
    const v = verdict(facts);
    assert.deepEqual([v.compensating.tone, v.better.tone, v.learning.tone, v.data.tone], ['idle', 'idle', 'idle', 'bad']);
    assert.match(v.compensating.detail, /last known: Compensating/);
  }
  assert.equal(verdict({ ...GOOD, ageS: 3, finished: true }).compensating.tone, 'good');
});

test('a loss that somebody has seen no longer warns', () => {
  const seen = verdict({ ...GOOD, missing: 2, lossAgeS: 30, lossSeen: true, lossAcknowledged: true }).data;
  assert.deepEqual([seen.tone, seen.text], ['good', 'Good']);
  assert.match(seen.detail, /2 samples missing, the last 30 s ago, acknowledged/);
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
