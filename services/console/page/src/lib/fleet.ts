// SPDX-License-Identifier: Apache-2.0
// In which order several gyros are shown: what needs somebody comes first, since a small screen shows no more.
import { QUESTIONS, type Tone, type Verdict } from './verdict.ts';

const URGENCY: Partial<Record<Tone, number>> = { bad: 2, warn: 1 };

/** By the worst of its answers. */
function urgency(verdict: Verdict): number {
  return Math.max(...QUESTIONS.map(({ id }) => URGENCY[verdict[id].tone] ?? 0));
}

/** Those with a bad answer, then those with a warning, then the others, each in the order in which they came. */
export function worstFirst<Shown extends { verdict: Verdict }>(gyros: Shown[]): Shown[] {
  return [...gyros].sort((a, b) => urgency(b.verdict) - urgency(a.verdict));
}
