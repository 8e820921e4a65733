// SPDX-License-Identifier: Apache-2.0
// Twenty situations, and the words of the headline and the banner in each. What the page was told goes in, what it says
// comes out; a row names only what differs from a healthy gyro.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { outcomeText } from '../src/lib/commands.ts';
import type { Comparison, Obstacle } from '../src/lib/comparison.ts';
import { factsOf, type Known } from '../src/lib/facts.ts';
import type { GyroSummary, Live, PlainStatus } from '../src/lib/messages.ts';
import { QUESTIONS, TONE_GLYPH, banner, verdict, type AxisFacts } from '../src/lib/verdict.ts';

const NOW = 1_000_000_000; // ms
const S = 1000;

const compared = (ratio: number, blocks = 60): Comparison => ({ blocks, raw: ratio, compensated: 1, against: 'rest' });
const AXIS: AxisFacts = { valid: true, mode: 1, reason: '', comparison: compared(33), harmed: false };
const all = (axis: Partial<AxisFacts>): AxisFacts[] => [0, 1, 2].map(() => ({ ...AXIS, ...axis }));
const passing = (reason: string, obstacle: Obstacle): AxisFacts[] => all({ mode: 0, reason, comparison: { obstacle } });

const summary = (gyro: number, axes: AxisFacts[] = all({}), more: Partial<GyroSummary> = {}): GyroSummary => ({
  gyro, arrivedMs: NOW - 0.5 * S, ageS: 0.01, sensorTimeS: 7000, sampleIntervalS: 0.005, missing: 0, blockS: 60, pace: 1, axes, ...more,
});
const live = (axes: AxisFacts[] = all({}), more: Partial<Live> = {}): Live => ({
  gyro: 1, arrivedMs: NOW - 10, sensorTimeS: 7000, sampleIntervalS: 0.005, sequence: 1, missing: 0, modelEpoch: 1, instance: 0, answered: 1, pace: 1, behindS: 0,
  latencyP50Ms: 1, latencyP99Ms: 1, latencyCount: 1, rows: { samples: 1, history: 1 }, probes: [],
  axes: axes.map(({ valid, mode, reason }) => ({ valid, mode, reason, rung: 'stack', clipped: false, raw: 1, compensated: 1, sigma: 1 })), ...more,
});
const service = (name: string, processId: number, more: Partial<PlainStatus> = {}): PlainStatus => ({
  service: name, host: 'lab', processId, state: 'running', uptimeS: 600, summary: '', alive: true, atMs: NOW - 200, metrics: [], ...more,
});
const ownOutput = (...axes: number[]) => axes.map((value, a) => ({ name: `own_output_${'xyz'[a]}`, unit: '1', value }));
const gone = (secondsAgo: number): Partial<PlainStatus> => ({ alive: false, atMs: NOW - secondsAgo * S });
const ended = (secondsAgo: number): Partial<PlainStatus> => ({ ...gone(secondsAgo), state: 'stopping' });
const finished = [{ name: 'finished', unit: '1', value: 1 }];

interface Chain { publisher?: Partial<PlainStatus>; thermal?: Partial<PlainStatus>; compensation?: Partial<PlainStatus>; reports?: string }
const chain = ({ publisher, thermal, compensation, reports = '' }: Chain): PlainStatus[] => [
  service('gyro_publisher', 11, publisher), service('gyro_publisher:1', 11, publisher),
  service('thermal_publisher', 12, thermal), service('thermal_publisher:1', 12, thermal),
  service('compensation', 13, { summary: '1 gyro', ...compensation }), service('compensation:1', 13, { summary: reports, ...compensation }),
  service('allan_monitor', 14),
];
const HEALTHY: Known = {
  link: 'open', linkSinceMs: NOW - 600 * S, nowMs: NOW, gatewayAheadMs: 0, live: live(), fleet: [summary(1)], losses: new Map(), acknowledgedMs: NaN, dropped: 0, services: chain({}),
};
/** The same axes in the samples and in the gateway's summary. */
const axes = (of: AxisFacts[]): Partial<Known> => ({ live: live(of), fleet: [summary(1, of)] });
const silent = (seconds: number, more: Partial<Known> = {}): Partial<Known> => ({
  live: live(all({}), { arrivedMs: NOW - seconds * S }), fleet: [summary(1, all({}), { ageS: seconds - 0.5 })], ...more,
});
const lost = (missing: number, secondsAgo: number, seen: boolean): Partial<Known> => ({
  live: live(all({}), { missing }), losses: new Map([[1, { missing, sinceMs: NOW - secondsAgo * S, seen }]]),
});

interface Row {
  situation: string;
  known: Partial<Known>;
  gyro?: number;
  compensating: string;
  better: string;
  learning: string;
  data: string;
  banner?: string;
}

const COMPENSATING = '✓ Compensating: all three axes';
const BETTER = '✓ 33×: steadier than raw; means of 60 s over 60 min, at rest';
const LEARNING = '✓ Learning: at rest, or against a reference';
const GOOD = '✓ Good: live, none missing';
const HEADLINE = { compensating: COMPENSATING, better: BETTER, learning: LEARNING, data: GOOD };
const NOTHING = { compensating: '· –: no data yet', better: '· –: no data yet', learning: '· –: no data yet' };
const LAST_KNOWN = {
  compensating: '· Not known now: last known: Compensating, all three axes',
  better: '· 33×: steadier than raw; means of 60 s over 60 min, at rest',
  learning: '· Not known now: last known: Learning, at rest, or against a reference',
};
const WAITS = 'rates wait for temperatures; is thermal_publisher running?';

const TOUR: Row[] = [
  { situation: 'healthy', known: {}, ...HEADLINE },

  { situation: 'start: nothing runs yet', gyro: 0, known: { live: undefined, fleet: [], services: [] },
    ...NOTHING, data: '✕ No gyro: the gateway receives no compensated_rate in its domain' },
  { situation: 'start: services run, no sample came', known: { live: undefined, fleet: [] },
    ...NOTHING, data: '✕ No sample yet: services tell of this gyro; no compensated_rate of it came' },
  { situation: 'start: the page connects', known: { link: 'connecting', live: undefined, fleet: [], services: [] },
    ...NOTHING, data: '· Connecting: tries again by itself' },
  { situation: 'start: the page has just connected', known: { linkSinceMs: NOW - 0.3 * S, live: undefined, fleet: [] },
    ...NOTHING, data: '· Connecting: nothing was told yet' },
  { situation: 'start: first samples', known: axes(passing('no_estimate_yet', 'passthrough')), data: GOOD,
    compensating: '● Not compensating yet: nothing has been learned yet',
    better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
    learning: '● Not learning: nothing has been learned yet' },

  { situation: 'first minute: a mean is held', known: axes(all({ mode: 5, reason: 'initial_set', comparison: { obstacle: 'holding' } })), data: GOOD,
    compensating: '✓ Compensating: x, y, z by the last stationary mean',
    better: '· Not comparable yet: the first mean is held; comparing begins with the first model',
    learning: '● Not learning: the first set of labels is not complete yet' },
  { situation: 'first minutes: a model, and few minutes of it', known: axes(all({ comparison: { obstacle: 'short' } })),
    ...HEADLINE, better: '· Not comparable yet: needs three minutes at rest, or of a known true rate, with a model' },
  { situation: 'first minutes: chance could do it on one axis', known: axes([AXIS, { ...AXIS, comparison: compared(2, 5) }, { ...AXIS, comparison: compared(29, 5) }]),
    ...HEADLINE, better: '● 29–33×: steadier than raw on x, z, not comparable yet on y; means of 60 s over 5 min, at rest' },
  { situation: 'first minutes: chance could do it on all', known: axes(all({ comparison: compared(2, 5) })),
    ...HEADLINE, better: '· Not comparable yet: may be chance on x, y, z; means of 60 s over 5 min, at rest' },

  { situation: 'motion', known: axes(all({ mode: 2, reason: 'motion' })),
    ...HEADLINE, learning: '● Frozen: it moves; true rotation is never learned' },
  { situation: 'motion from the start', known: axes(passing('motion', 'motion')), data: GOOD,
    compensating: '● Not compensating yet: it moves; true rotation is never learned',
    better: '· Not comparable yet: it moves, and nobody publishes the true rate to compare with',
    learning: '● Not learning: it moves; true rotation is never learned' },

  { situation: 'hold', known: axes(all({ mode: 5, reason: 'model_worse_than_bias', comparison: compared(4) })), data: GOOD,
    compensating: '✓ Compensating: x, y, z by the last stationary mean',
    better: '✓ 4.0×: steadier than raw; means of 60 s over 60 min, at rest',
    learning: '● Not learning: the last stationary mean predicts better than the model just now' },

  { situation: 'less steady than raw by what may be chance', known: axes([AXIS, { ...AXIS, comparison: compared(0.7) }, { ...AXIS, comparison: compared(1.2) }]),
    ...HEADLINE, better: '▲ 0.70–33×: no better than raw on y; means of 60 s over 60 min, at rest' },
  { situation: 'harm by the spread', known: axes([AXIS, { ...AXIS, comparison: compared(0.5) }, AXIS]),
    ...HEADLINE, better: '✕ 0.50–33×: worse than raw on y; means of 60 s over 60 min, at rest' },
  { situation: 'harm by the Allan deviation', known: axes([AXIS, AXIS, { ...AXIS, harmed: true }]),
    ...HEADLINE, better: '▲ 33×: noisier than raw at some cluster time on z, says the Allan monitor; means of 60 s over 60 min, at rest' },

  { situation: 'harm by the Allan deviation, before minutes can be compared', known: axes(all({ harmed: true, comparison: { obstacle: 'short' } })),
    ...HEADLINE, better: '▲ Not comparable yet: noisier than raw at some cluster time on x, y, z, says the Allan monitor' },

  { situation: 'dead service: compensation', known: silent(14, { services: chain({ compensation: gone(12) }) }), ...LAST_KNOWN,
    data: '✕ Stale: 14 s old: compensation (host lab, pid 13) is gone since 12 s; shown is the last that did',
    banner: 'compensation (host lab, pid 13) is gone: no sample comes any more; everything shown is old. (since 12 s; newest sample 14 s ago)' },
  { situation: 'dead service: thermal_publisher of a replay', known: silent(14, { services: chain({ thermal: gone(13), reports: WAITS }) }), ...LAST_KNOWN,
    data: '✕ Stale: 14 s old: thermal_publisher (host lab, pid 12) is gone since 13 s; shown is the last that did',
    banner: 'thermal_publisher (host lab, pid 12) is gone: no sample comes any more; everything shown is old. (since 13 s; newest sample 14 s ago)' },
  { situation: 'dead service: the publisher, before compensation', known: silent(300, { services: chain({ publisher: gone(299), compensation: gone(20) }) }), ...LAST_KNOWN,
    data: '✕ Stale: 5 min old: gyro_publisher (host lab, pid 11) is gone since 5 min and compensation (host lab, pid 13) is gone since 20 s; shown is the last that did',
    banner: 'gyro_publisher (host lab, pid 11) is gone and compensation (host lab, pid 13) is gone: no sample comes any more; everything shown is old. (since 5 min; newest sample 5 min ago)' },
  { situation: 'dead service: the publisher was stopped', known: silent(9, { services: chain({ publisher: ended(9) }) }), ...LAST_KNOWN,
    data: '✕ Stale: 9.0 s old: gyro_publisher (host lab, pid 11) has ended 9.0 s ago; shown is the last that did',
    banner: 'gyro_publisher (host lab, pid 11) has ended: no sample comes any more; everything shown is old. (9.0 s ago; newest sample 9.0 s ago)' },
  { situation: 'a dead thermal_publisher that nothing waits for', known: { services: chain({ thermal: gone(3600) }), ...axes(all({ mode: 3, reason: 'temperature_stale' })) }, better: BETTER, data: GOOD,
    compensating: '✓ Compensating: x, y, z by a simpler estimate than the model',
    learning: '● Not learning: no recent temperature' },

  { situation: 'stale data, and nobody is known to be gone', known: silent(3), ...LAST_KNOWN,
    data: '✕ Stale: 3.0 s old: no sample comes; shown is the last that did',
    banner: 'No sample comes any more; everything shown is old. (newest sample 3.0 s ago)' },
  { situation: 'stale data, and the page connected at an hour that has not come', known: silent(3, { linkSinceMs: NOW + 3600 * S }), ...LAST_KNOWN,
    data: '✕ Stale: 3.0 s old: no sample comes; shown is the last that did',
    banner: 'No sample comes any more; everything shown is old. (newest sample 3.0 s ago)' },
  { situation: 'twenty samples of a slow gyro make silence', known: { live: live(all({}), { sampleIntervalS: 1, arrivedMs: NOW - 3 * S }) }, ...HEADLINE },
  { situation: 'a record was published to its end', known: silent(90, { services: chain({ publisher: { ...ended(80), metrics: finished } }) }),
    ...HEADLINE, data: '● Source has ended: newest sample 90 s ago' },
  { situation: 'a record was published to its end, and then the compensation died', ...LAST_KNOWN,
    known: silent(90, { services: chain({ publisher: { ...ended(80), metrics: finished }, compensation: gone(12) }) }),
    data: '● Source has ended: newest sample 90 s ago; gyro_publisher (host lab, pid 11) has ended 80 s ago and compensation (host lab, pid 13) is gone since 12 s' },
  { situation: 'a record was published to its end, the compensation died, and the page was opened after it', ...LAST_KNOWN,
    known: { live: undefined, fleet: [summary(1, all({}), { ageS: 89.5 })], services: chain({ publisher: { ...ended(80), metrics: finished }, compensation: gone(12) }) },
    data: '● Source has ended: newest sample 90 s ago; gyro_publisher (host lab, pid 11) has ended 80 s ago and compensation (host lab, pid 13) is gone since 12 s' },

  { situation: 'replay at 60 times real time', known: { live: live(all({}), { pace: 60 }) }, ...HEADLINE, data: '✓ Good (replay 60×): none missing' },

  { situation: 'whether it is a replay is not known yet', known: { live: live(all({}), { pace: NaN }) }, ...HEADLINE, data: '✓ Good: none missing' },

  { situation: 'ten gyros: one that is not shown', gyro: 7, known: { fleet: [...'123456789'].map((g) => summary(Number(g))).concat(summary(10)) }, ...HEADLINE },
  { situation: 'ten gyros: one of them is silent', gyro: 7, known: { fleet: [summary(1), summary(7, all({}), { ageS: 39.5 })] }, ...LAST_KNOWN,
    data: '✕ Stale: 40 s old: no sample comes; shown is the last that did',
    banner: 'No sample comes any more; everything shown is old. (newest sample 40 s ago)' },
  { situation: 'ten gyros: the publisher of one is dead', gyro: 7,
    known: { fleet: [summary(1), summary(7, all({}), { ageS: 39.5 })], services: [...chain({}), service('gyro_publisher:7', 77, gone(40))] }, ...LAST_KNOWN,
    data: '✕ Stale: 40 s old: gyro_publisher (host lab, pid 77) is gone since 40 s; shown is the last that did',
    banner: 'gyro_publisher (host lab, pid 77) is gone: no sample comes any more; everything shown is old. (since 40 s; newest sample 40 s ago)' },
  { situation: 'ten gyros: another one has finished', known: { services: [...chain({}), service('gyro_publisher:7', 77, { metrics: finished })], ...silent(3) }, ...LAST_KNOWN,
    data: '✕ Stale: 3.0 s old: no sample comes; shown is the last that did',
    banner: 'No sample comes any more; everything shown is old. (newest sample 3.0 s ago)' },
  { situation: 'ten gyros: the gateway tells nothing any more', gyro: 7, known: { fleet: [summary(7, all({}), { arrivedMs: NOW - 5 * S })] }, ...LAST_KNOWN,
    data: '✕ Stale: 5.0 s old: no sample comes; shown is the last that did',
    banner: 'No sample comes any more; everything shown is old. (newest sample 5.0 s ago)' },

  { situation: 'late console join: losses of before', known: lost(7, 60, false), ...HEADLINE, data: '✓ Good: live, 7 samples missing, none in the 60 s since this page listens' },
  { situation: 'late console join: samples before the first summary', known: { fleet: [] }, ...HEADLINE,
    better: '· Not comparable yet: the gateway has not said yet' },
  { situation: 'another gyro is chosen: its summary before its samples', gyro: 2, known: { fleet: [summary(1), summary(2)] }, ...HEADLINE },

  { situation: 'recorder ended orderly', known: { services: [...chain({}), service('recorder', 15, ended(5))] }, ...HEADLINE },

  { situation: 'lost samples', known: lost(2, 30, true), ...HEADLINE, data: '▲ With losses: 2 samples missing, the last 30 s ago' },
  { situation: 'lost samples, history by now', known: lost(1, 1200, true), ...HEADLINE, data: '✓ Good: live, 1 sample missing, the last 20 min ago' },
  { situation: 'lost samples in a replay', known: { ...lost(2, 5, true), live: live(all({}), { missing: 2, pace: 60 }) }, ...HEADLINE,
    data: '▲ With losses (replay 60×): 2 samples missing, the last 5.0 s ago' },
  { situation: 'a link that is slower than the samples', known: { live: live(all({}), { behindS: 12 }) },
    ...LAST_KNOWN, data: '▲ Late: 12 s behind: samples wait for the link or this browser; shown is what was then',
    banner: 'What is shown is old: it waits for the link or this browser. (12 s behind)' },
  { situation: 'frames lost for a slow browser', known: { dropped: 5 }, ...HEADLINE, data: '▲ Browser too slow: 5 frames dropped for this browser' },

  { situation: 'standby takeover', known: { services: [service('compensation/1', 21, gone(5)), service('compensation/2', 22), service('compensation/2:1', 22)], live: live(all({}), { instance: 2 }) },
    ...HEADLINE },
  { situation: 'standby takeover: the second one died too', ...LAST_KNOWN,
    known: silent(6, { services: [service('compensation/1', 21, gone(500)), service('compensation/2', 22, gone(5))] }),
    data: '✕ Stale: 6.0 s old: compensation/2 (host lab, pid 22) is gone since 5.0 s; shown is the last that did',
    banner: 'compensation/2 (host lab, pid 22) is gone: no sample comes any more; everything shown is old. (since 5.0 s; newest sample 6.0 s ago)' },

  { situation: "clock step: the system's clock is an hour ahead of the browser's", ...LAST_KNOWN,
    known: silent(14, { gatewayAheadMs: 3600 * S, services: chain({ compensation: gone(12 - 3600) }) }),
    data: '✕ Stale: 14 s old: compensation (host lab, pid 13) is gone since 12 s; shown is the last that did',
    banner: 'compensation (host lab, pid 13) is gone: no sample comes any more; everything shown is old. (since 12 s; newest sample 14 s ago)' },

  { situation: 'double correction', known: { services: chain({ compensation: { metrics: ownOutput(1, 0, 1) } }) }, ...HEADLINE,
    data: '✕ Corrected twice: the compensation is given its own output on x, z; publish compensated rates under another gyro id' },
  { situation: 'wrong sign', known: axes([AXIS, { ...AXIS, mode: 2, reason: 'polarity_reversed' }, AXIS]), ...HEADLINE,
    learning: '● Learning on x, z: not on y: it turns the other way round than its reference or the Earth says',
    data: '✕ Wrong sign: y: it turns the other way round than its reference or the Earth says; mounting.axes turns an axis round' },

  { situation: 'passthrough by command', known: axes(passing('commanded', 'passthrough')), data: GOOD,
    compensating: '● Not compensating: somebody commanded it',
    better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
    learning: '● Frozen: somebody commanded it' },
  { situation: 'passthrough for a fault', known: axes(passing('temperature_missing', 'passthrough')), data: GOOD,
    compensating: '✕ Not compensating: a temperature that the model needs is missing',
    better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
    learning: '● Not learning: a temperature that the model needs is missing' },

  { situation: 'no thermometer at the start of a replay', gyro: 0, ...NOTHING,
    known: { live: undefined, fleet: [], services: chain({ reports: WAITS }).filter((s) => !s.service.startsWith('thermal')) },
    data: `✕ No sample yet: compensation reports "${WAITS}"`,
    banner: `compensation reports "${WAITS}": no sample comes.` },

  { situation: 'refused command', known: {}, ...HEADLINE },

  { situation: 'service restarted: it is there again', known: { services: chain({ compensation: { uptimeS: 3, processId: 99, metrics: ownOutput(0, 0, 0) } }) }, ...HEADLINE },
  { situation: 'service restarted: it learns anew', data: GOOD,
    known: { ...axes(passing('no_estimate_yet', 'passthrough')), services: chain({ compensation: { uptimeS: 3 } }) },
    compensating: '● Not compensating yet: nothing has been learned yet',
    better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
    learning: '● Not learning: nothing has been learned yet' },

  { situation: 'gateway gone', known: { ...silent(2), link: 'gone' }, ...LAST_KNOWN,
    data: '✕ Gateway gone: shown is what came until 2.0 s ago',
    banner: 'The gateway is gone. What came before is kept.' },
  { situation: 'gateway back, and nothing came from it yet', known: { ...silent(4), linkSinceMs: NOW - 0.3 * S, services: [] }, ...LAST_KNOWN,
    data: '· Connecting: shown is what came until 4.0 s ago' },
  { situation: 'gateway gone before it told anything', known: { link: 'gone', live: undefined, fleet: [], services: [] },
    ...NOTHING, data: '✕ Gateway gone: tries again by itself',
    banner: 'The gateway is gone. What came before is kept.' },
];

for (const { situation, known, gyro = 1, ...expected } of TOUR) {
  test(situation, () => {
    const facts = factsOf({ ...HEALTHY, ...known }, gyro);
    const said = verdict(facts);
    const above = banner(facts);
    const tiles = QUESTIONS.map(({ id }) => [id, `${TONE_GLYPH[said[id].tone]} ${said[id].text}: ${said[id].detail}`]);
    assert.deepEqual(
      { ...Object.fromEntries(tiles), banner: above && `${above.text}${above.age && ` (${above.age})`}` },
      { banner: undefined, ...expected },
    );
  });
}

test('a command that was refused is told from one that nobody answered', () => {
  assert.deepEqual((['done', 'refused', 'unanswered'] as const).map(outcomeText), ['Done', 'Refused', 'Not answered']);
});
