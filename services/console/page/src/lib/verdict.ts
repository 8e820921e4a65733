// SPDX-License-Identifier: Apache-2.0
// The headline: is it compensating, how much better is it, does it learn and why not, is the data good. No clock, no
// page: facts in, sentences out.
import { JUDGEMENT_TEXT, judge, obstacleText, ratioText, type Comparison, type Judgement } from './comparison.ts';
import { ageText, duration } from './scale.ts';

/** idl/proto/telemetry.proto, Mode */
export const MODES = ['passthrough', 'learning', 'frozen', 'fallback', 'out_of_domain', 'holding'] as const;
export type ModeName = (typeof MODES)[number];

export type Tone = 'good' | 'note' | 'warn' | 'bad' | 'idle';

/** A shape beside the colour. */
export const TONE_GLYPH: Record<Tone, string> = { good: '✓', note: '●', warn: '▲', bad: '✕', idle: '·' };

export interface ModeText {
  label: string;
  glyph: string; // a shape beside the colour
  tone: Tone;
  means: string;
}

const MODE_TEXT: Record<ModeName, ModeText> = {
  passthrough: { label: 'Not compensating', glyph: '○', tone: 'bad', means: 'nothing is taken off: raw rates pass as they come' },
  learning: { label: 'Learning', glyph: '●', tone: 'good', means: 'at rest, or against a reference' },
  frozen: { label: 'Frozen', glyph: '■', tone: 'note', means: 'the model compensates and learns nothing now' },
  fallback: { label: 'Fallback', glyph: '▲', tone: 'note', means: 'a simpler estimate compensates' },
  out_of_domain: { label: 'Out of domain', glyph: '◆', tone: 'warn', means: 'outside what was learned: extrapolated or held, and stated as less certain' },
  holding: { label: 'Holding', glyph: '▬', tone: 'note', means: 'the last stationary mean compensates: nothing known predicts better' },
};

/** Reasons for passthrough that pass by themselves, and those that somebody chose. */
const STARTING = new Set(['no_estimate_yet', 'initial_set', 'motion', 'settling', 'temperature_rate_not_ready']);
const CHOSEN = new Set(['scheme_none', 'commanded']);

/** A mode in words; passing through is no fault at a start, or where somebody wants it. */
export function modeText(mode: number, reason = ''): ModeText {
  const text = MODE_TEXT[MODES[mode] ?? 'passthrough'];
  if (mode !== 0) return text;
  if (STARTING.has(reason)) return { ...text, label: 'Not compensating yet', tone: 'note' };
  return CHOSEN.has(reason) ? { ...text, tone: 'note' } : text;
}

const REASON_TEXT: Record<string, string> = {
  none: '',
  no_estimate_yet: 'nothing has been learned yet',
  initial_set: 'the first set of labels is not complete yet',
  motion: 'it moves; true rotation is never learned',
  earth_rate_unknown: 'Earth rate is unknown here and must not be learned as drift',
  level_implausible: 'at rest, but the level is above the largest plausible drift',
  commanded: 'somebody commanded it',
  temperature_missing: 'a temperature that the model needs is missing',
  temperature_stale: 'no recent temperature',
  probe_stuck: 'a temperature probe is stuck while others move',
  temperature_rate_not_ready: 'the temperature history is still too short',
  model_worse_than_bias: 'the last stationary mean predicts better than the model just now',
  outside_learned: 'temperature or its rate is outside what was learned',
  invalid_input: 'the raw sample was invalid and passes as it came',
  scheme_none: 'it is configured to compensate nothing',
  settling: 'still again; waiting until rest is certain',
  polarity_reversed: 'it turns the other way round than its reference or the Earth says',
};

/** A reason in plain words; one that isn't known here as it came. */
export function reasonText(reason: string): string {
  return REASON_TEXT[reason] ?? reason.replaceAll('_', ' ');
}

const RUNG_TEXT: Record<string, string> = {
  none: 'nothing',
  factory_polynomial: 'factory polynomial',
  stationary_bias: 'last stationary mean',
  online_svr: 'online SVR',
  prior: "the twin's model",
  stack: 'experts',
};

export function rungText(rung: string): string {
  return RUNG_TEXT[rung] ?? rung.replaceAll('_', ' ');
}

const EXPERT_TEXT: Record<string, string> = {
  hold: 'last mean',
  random_walk: 'random walk',
  shupe: 'Shupe',
  online_svr: 'SVR',
};
const SMALLEST_SHARE = 0.1;

/** "60 % lagged, 30 % SVR": experts with a tenth of an axis's forecast or more, the largest first. */
export function sharesText(metrics: { name: string; value: number }[], axis: number): string {
  const ending = `_${'xyz'[axis]}`;
  return metrics
    .filter((m) => m.name.startsWith('share_') && m.name.endsWith(ending) && m.value >= SMALLEST_SHARE)
    .sort((a, b) => b.value - a.value)
    .map((m) => {
      const expert = m.name.slice('share_'.length, -ending.length);
      return `${Math.round(100 * m.value)} % ${EXPERT_TEXT[expert] ?? expert.replaceAll('_', ' ')}`;
    })
    .join(', ');
}

export type Link = 'connecting' | 'open' | 'gone';

export interface AxisFacts {
  valid: boolean;
  mode: number;
  reason: string;
  comparison: Comparison;
  harmed: boolean; // the Allan monitor finds it noisier than raw at some cluster time
}

/** Why no sample comes: "compensation (host h, pid 123) is gone", "since 12 s". */
export interface Cause {
  what: string;
  when: string; // empty: no time belongs to it
}

export interface Facts {
  link: Link;
  linkS: number; // since the link is as it is
  known: boolean; // services tell of this gyro
  present: boolean; // a gyro's samples came at least once
  ageS: number; // since the newest sample came
  behindS: number; // how long samples wait for the link or this browser before they come
  sampleIntervalS: number;
  finished: boolean; // the source says it has ended
  compensationGone: boolean; // nobody is left who compensates
  pace: number; // sensor seconds a second; NaN while unknown
  missing: number;
  lossAgeS: number; // since the newest that this page saw go missing; without one, since it began to look
  lossSeen: boolean;
  lossAcknowledged?: boolean; // somebody has seen it
  dropped: number; // frames that this client was too slow for
  blockS: number; // of the means that are compared
  correctedTwice: number[]; // axes found to be given the compensation's own output
  causes: Cause[]; // of no sample coming, where any is known
  axes: AxisFacts[];
}

export interface Statement {
  tone: Tone;
  text: string;
  detail: string;
}

export interface Verdict {
  compensating: Statement;
  better: Statement;
  learning: Statement;
  data: Statement;
}

/** The four, in the order in which they are asked; `short` where there is room for a word or two. */
export const QUESTIONS: { id: keyof Verdict; question: string; short: string }[] = [
  { id: 'compensating', question: 'Compensating?', short: 'rate' },
  { id: 'better', question: 'How much better than raw?', short: 'ratio' },
  { id: 'learning', question: 'Learning?', short: 'model' },
  { id: 'data', question: 'Is the data good?', short: 'data' },
];

const AXIS = ['x', 'y', 'z'];
const STALE_INTERVALS = 20;
const STALE_AT_LEAST_S = 1.0;

/** Silence after which the data count as stale: a second, or 20 samples where that is longer. */
export function staleAfterS(sampleIntervalS: number): number {
  return Math.max(STALE_AT_LEAST_S, STALE_INTERVALS * (Number.isFinite(sampleIntervalS) ? sampleIntervalS : 0));
}

export function isStale(facts: Facts): boolean {
  return facts.present && facts.ageS > staleAfterS(facts.sampleIntervalS);
}

/** Samples come, and are not of now. */
export function isLate(facts: Facts): boolean {
  return facts.present && facts.behindS > staleAfterS(facts.sampleIntervalS);
}

/** The link stands for too short a time to say that nothing comes; below 0 a clock was set, and nobody knows for how long. */
function hasJustBegun(facts: Facts): boolean {
  return facts.link === 'open' && facts.linkS >= 0 && facts.linkS < staleAfterS(facts.sampleIntervalS) && !(facts.ageS < facts.linkS);
}

function names(axes: number[]): string {
  return axes.map((a) => AXIS[a]).join(', ');
}

function where(facts: Facts, holds: (axis: AxisFacts) => boolean): number[] {
  return facts.axes.map((axis, i) => (axis.valid && holds(axis) ? i : -1)).filter((i) => i >= 0);
}

/** Of axes that pass through, the one whose reason is a fault if any is. */
function gravest(facts: Facts, off: number[]): ModeText & { axis: number } {
  const texts = off.map((axis) => ({ axis, ...modeText(0, facts.axes[axis].reason) }));
  return texts.find((text) => text.tone === 'bad') ?? texts[0];
}

function compensating(facts: Facts): Statement {
  const valid = where(facts, () => true);
  const off = where(facts, (axis) => axis.mode === 0);
  const weak = where(facts, (axis) => axis.mode === 4);
  const simpler = where(facts, (axis) => axis.mode === 3);
  const holding = where(facts, (axis) => axis.mode === 5);
  if (valid.length === 0) return { tone: 'bad', text: 'No valid axis', detail: 'every axis is marked invalid by its source' };
  if (off.length === valid.length) {
    const worst = gravest(facts, off);
    return { tone: worst.tone, text: worst.label, detail: reasonText(facts.axes[worst.axis].reason) || 'raw rates pass as they come' };
  }
  if (off.length > 0) {
    const worst = gravest(facts, off);
    const tone = worst.tone === 'note' ? 'note' : 'warn';
    return { tone, text: 'Partly compensating', detail: `not on ${names(off)}: ${reasonText(facts.axes[worst.axis].reason)}` };
  }
  if (weak.length > 0) return { tone: 'warn', text: 'Compensating, weakly', detail: `${names(weak)}: ${modeText(facts.axes[weak[0]].mode).means}` };
  if (simpler.length > 0) return { tone: 'good', text: 'Compensating', detail: `${names(simpler)} by a simpler estimate than the model` };
  if (holding.length > 0) return { tone: 'good', text: 'Compensating', detail: `${names(holding)} by the last stationary mean` };
  return { tone: 'good', text: 'Compensating', detail: valid.length === 3 ? 'all three axes' : `axes ${names(valid)}` };
}

const AGAINST_TEXT = { rest: 'at rest', reference: 'against the reference' };

function horizon(facts: Facts): string {
  const known = facts.axes.flatMap(({ valid, comparison }, axis) => (valid && !('obstacle' in comparison) ? [{ axis, ...comparison }] : []));
  const least = Math.min(...known.map(({ blocks }) => blocks));
  const of = (against: 'rest' | 'reference') => known.filter((one) => one.against === against).map(({ axis }) => axis);
  const kinds = (['rest', 'reference'] as const).filter((against) => of(against).length > 0);
  const over = kinds.map((against) => (kinds.length > 1 ? `${names(of(against))} ${AGAINST_TEXT[against]}` : AGAINST_TEXT[against]));
  return `means of ${duration(facts.blockS)} over ${duration(least * facts.blockS)}, ${over.join(', ')}`;
}

/** The least and the greatest of some ratios: "29–308×". */
function rangeText(ratios: number[]): string {
  const [least, most] = [ratioText(Math.min(...ratios)), ratioText(Math.max(...ratios))];
  return least === most ? least : `${least.replace('×', '')}–${most}`;
}

/** Of the axes that can be judged; that of another is said beside them, and keeps the answer from being green. */
function better(facts: Facts): Statement {
  const judged = facts.axes.map((axis) => (axis.valid ? judge(axis.comparison) : undefined));
  const of = (judgement: Judgement) => names([0, 1, 2].filter((a) => judged[a]?.judgement === judgement));
  const ratios = judged.map((axis) => axis?.ratio ?? NaN).filter(Number.isFinite);
  const text = ratios.length > 0 ? rangeText(ratios) : 'Not comparable yet';
  const over = judged.some((axis) => axis !== undefined) ? `; ${horizon(facts)}` : '';
  const harmed = names(where(facts, (axis) => axis.harmed));
  if (of('worse')) return { tone: 'bad', text, detail: `worse than raw on ${of('worse')}${over}` };
  if (harmed) return { tone: 'warn', text, detail: `noisier than raw at some cluster time on ${harmed}, says the Allan monitor${over}` };
  if (ratios.length === 0) {
    const first = where(facts, (axis) => 'obstacle' in axis.comparison).map((i) => facts.axes[i].comparison)[0];
    const why = first && 'obstacle' in first ? obstacleText(first.obstacle) : 'no valid axis';
    return { tone: 'idle', text, detail: over ? `may be chance on ${of('unsure')}${over}` : why };
  }
  for (const weak of ['not', 'hardly'] as const) {
    if (of(weak)) return { tone: 'warn', text, detail: `${JUDGEMENT_TEXT[weak]} on ${of(weak)}${over}` };
  }
  const open = names(where(facts, ({ comparison }) => (judge(comparison)?.judgement ?? 'unsure') === 'unsure'));
  if (open) return { tone: 'note', text, detail: `steadier than raw on ${of('better')}, not comparable yet on ${open}${over}` };
  return { tone: 'good', text, detail: `steadier than raw${over}` };
}

function learning(facts: Facts): Statement {
  const valid = where(facts, () => true);
  const on = where(facts, (axis) => axis.mode === 1);
  if (valid.length === 0) return { tone: 'idle', text: 'Not learning', detail: 'no valid axis' };
  if (on.length === valid.length) return { tone: 'good', text: 'Learning', detail: 'at rest, or against a reference' };
  const others = valid.filter((i) => !on.includes(i));
  const reasons = [...new Set(others.map((i) => reasonText(facts.axes[i].reason)).filter((text) => text !== ''))];
  const why = reasons.length > 0 ? reasons.join('; ') : modeText(facts.axes[others[0]].mode).means;
  const commanded = others.some((i) => facts.axes[i].reason === 'commanded'); // then no axis learns, whatever else is said
  const frozen = commanded || others.every((i) => facts.axes[i].mode === 2);
  if (on.length === 0) return { tone: 'note', text: frozen ? 'Frozen' : 'Not learning', detail: why };
  return { tone: 'note', text: `Learning on ${names(on)}`, detail: `not on ${names(others)}: ${why}` };
}

export function isReplay(facts: Facts): boolean {
  return Number.isFinite(facts.pace) && (facts.pace > 1.3 || facts.pace < 0.7);
}

const LOSS_COUNTS_S = 600; // then it is history, shown with its age

function lossText(facts: Facts): string {
  if (facts.missing === 0) return '';
  const when = facts.lossSeen ? `the last ${ageText(facts.lossAgeS)} ago${facts.lossAcknowledged ? ', acknowledged' : ''}` : `none in the ${ageText(facts.lossAgeS)} since this page listens`;
  return `${facts.missing} sample${facts.missing === 1 ? '' : 's'} missing, ${when}`;
}

/** Rates that come, and are not what they should be. */
function inputFault(facts: Facts): Statement | undefined {
  const reversed = names(where(facts, (axis) => axis.reason === 'polarity_reversed'));
  if (reversed) return { tone: 'bad', text: 'Wrong sign', detail: `${reversed}: ${reasonText('polarity_reversed')}; mounting.axes turns an axis round` };
  if (facts.correctedTwice.length === 0) return undefined;
  const of = names(facts.correctedTwice);
  return { tone: 'bad', text: 'Corrected twice', detail: `the compensation is given its own output on ${of}; publish compensated rates under another gyro id` };
}

function causeText(facts: Facts): string {
  return facts.causes.map(({ what, when }) => (when ? `${what} ${when}` : what)).join(' and ');
}

function data(facts: Facts): Statement {
  if (facts.link !== 'open') {
    return { tone: 'bad', text: 'Gateway gone', detail: `shown is what came until ${ageText(facts.ageS)} ago` };
  }
  if (isStale(facts) && hasJustBegun(facts)) return { tone: 'idle', text: 'Connecting', detail: `shown is what came until ${ageText(facts.ageS)} ago` };
  if (isStale(facts)) {
    return facts.finished
      ? { tone: 'note', text: 'Source has ended', detail: `newest sample ${ageText(facts.ageS)} ago${facts.compensationGone ? `; ${causeText(facts)}` : ''}` }
      : { tone: 'bad', text: `Stale: ${ageText(facts.ageS)} old`, detail: `${causeText(facts) || 'no sample comes'}; shown is the last that did` };
  }
  const fault = inputFault(facts);
  if (fault) return fault;
  if (isLate(facts)) return { tone: 'warn', text: `Late: ${ageText(facts.behindS)} behind`, detail: 'samples wait for the link or this browser; shown is what was then' };
  const replay = isReplay(facts) ? ` (replay ${facts.pace >= 10 ? Math.round(facts.pace) : facts.pace.toFixed(1)}×)` : '';
  const lost = lossText(facts);
  const slow = facts.dropped > 0 ? `${facts.dropped} frames dropped for this browser` : '';
  const fresh = facts.missing > 0 && facts.lossSeen && !facts.lossAcknowledged && facts.lossAgeS < LOSS_COUNTS_S;
  const invalid = [0, 1, 2].filter((a) => !facts.axes[a].valid);
  if (invalid.length === 3) return { tone: 'bad', text: 'No valid axis', detail: 'every axis is marked invalid by its source' };
  if (fresh || slow) return { tone: 'warn', text: `${fresh ? 'With losses' : 'Browser too slow'}${replay}`, detail: [lost, slow].filter(Boolean).join(', ') };
  const live = Number.isFinite(facts.pace) && !replay ? 'live, ' : ''; // it takes a second or two to know
  const well = `${live}${lost || 'none missing'}`;
  if (invalid.length > 0) return { tone: 'note', text: `Not of ${names(invalid)}${replay}`, detail: `${names(invalid)}: marked invalid by the source; ${well}` };
  return { tone: 'good', text: `Good${replay}`, detail: well };
}

/** What was said last, when nobody can say it any more. */
function past(statement: Statement): Statement {
  const last = `last known: ${statement.text}${statement.detail ? `, ${statement.detail}` : ''}`;
  return { tone: 'idle', text: 'Not known now', detail: last };
}

/** Whether what is shown is no longer of now. That of a source that has ended is, while somebody stands by to compensate: nothing newer will come. */
export function isPast(facts: Facts): boolean {
  return facts.link !== 'open' || (isStale(facts) ? !facts.finished || facts.compensationGone : isLate(facts));
}

/** No sample ever came. */
function absent(facts: Facts): Statement {
  const retries = 'tries again by itself';
  if (facts.link === 'connecting') return { tone: 'idle', text: 'Connecting', detail: retries };
  if (facts.link === 'gone') return { tone: 'bad', text: 'Gateway gone', detail: retries };
  if (hasJustBegun(facts)) return { tone: 'idle', text: 'Connecting', detail: 'nothing was told yet' };
  if (facts.causes.length > 0) return { tone: 'bad', text: 'No sample yet', detail: causeText(facts) };
  if (facts.known) return { tone: 'bad', text: 'No sample yet', detail: 'services tell of this gyro; no compensated_rate of it came' };
  return { tone: 'bad', text: 'No gyro', detail: 'the gateway receives no compensated_rate in its domain' };
}

/** What stands above everything, and behind it what changes by the second. Nothing: nothing does. */
export function banner(facts: Facts): { text: string; age: string } | undefined {
  if (facts.link === 'gone') return { text: 'The gateway is gone. What came before is kept.', age: '' };
  const waits = !facts.present && facts.causes.length > 0;
  if (facts.link !== 'open' || hasJustBegun(facts) || !(waits || isPast(facts))) return undefined;
  if (facts.present && isStale(facts) && facts.finished) return undefined; // no sample is expected
  if (!waits && !isStale(facts)) return { text: 'What is shown is old: it waits for the link or this browser.', age: `${ageText(facts.behindS)} behind` };
  const silence = waits ? 'no sample comes.' : 'no sample comes any more; everything shown is old.';
  const why = facts.causes.map(({ what }) => what).join(' and ');
  const text = why ? `${why}: ${silence}` : silence.replace('no', 'No');
  const ages = [facts.causes[0]?.when, waits ? '' : `newest sample ${ageText(facts.ageS)} ago`];
  return { text, age: ages.filter(Boolean).join('; ') };
}

/** What the headline says. Without samples all four say so; without news only the last is of now. */
export function verdict(facts: Facts): Verdict {
  if (!facts.present) {
    const nothing: Statement = { tone: 'idle', text: '–', detail: 'no data yet' };
    return { compensating: nothing, better: nothing, learning: nothing, data: absent(facts) };
  }
  const now: Verdict = { compensating: compensating(facts), better: better(facts), learning: learning(facts), data: data(facts) };
  if (!isPast(facts)) return now;
  return { ...now, compensating: past(now.compensating), better: { ...now.better, tone: 'idle' }, learning: past(now.learning) };
}
