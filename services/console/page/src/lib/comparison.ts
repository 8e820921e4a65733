// SPDX-License-Identifier: Apache-2.0
// Raw against compensated rate, as the gateway compares them: what it is worth, and what may be shown of it.

/** Why raw and compensated can't be compared now; `unknown`: the gateway has not said yet. */
export type Obstacle = 'passthrough' | 'holding' | 'motion' | 'short' | 'unknown';

/** Standard deviation of means over blocks of equal time: what is left once white noise is averaged out. */
export interface BlockSpread {
  blocks: number;
  raw: number; // deg/h
  compensated: number; // deg/h
  against: 'rest' | 'reference';
}

export type Comparison = BlockSpread | { obstacle: Obstacle };

const OBSTACLE_TEXT: Record<Obstacle, string> = {
  passthrough: 'nothing is taken off yet; comparing begins with the first model',
  holding: 'the first mean is held; comparing begins with the first model',
  motion: 'it moves, and nobody publishes the true rate to compare with',
  short: 'needs three minutes at rest, or of a known true rate, with a model',
  unknown: 'the gateway has not said yet',
};

export function obstacleText(obstacle: Obstacle): string {
  return OBSTACLE_TEXT[obstacle];
}

export type Judgement = 'better' | 'hardly' | 'not' | 'worse' | 'unsure';

export const JUDGEMENT_TEXT: Record<Judgement, string> = {
  better: 'steadier than raw',
  hardly: 'hardly better than raw',
  not: 'no better than raw',
  worse: 'worse than raw',
  unsure: 'may be chance yet',
};

const MUCH_BETTER = 1.5;
const WORSE = 0.95;
const SIGMAS = 3;
const ENOUGH_BLOCKS = 30; // then to be alike is a result, and no lack of data

/**
 * Raw over compensated spread, and whether chance could do it: the logarithm of a standard deviation of n means has the
 * variance 1 / (2 (n - 1)), so that of a ratio of two has 1 / (n - 1). A ratio that may be chance is none: NaN.
 */
export function judge(comparison: Comparison): { ratio: number; judgement: Judgement } | undefined {
  if ('obstacle' in comparison) return undefined;
  const ratio = comparison.raw / comparison.compensated;
  const sure = Math.abs(Math.log(ratio)) > SIGMAS / Math.sqrt(comparison.blocks - 1);
  if (!sure && comparison.blocks < ENOUGH_BLOCKS) return { ratio: NaN, judgement: 'unsure' };
  if (ratio < 1) return { ratio, judgement: sure && ratio < WORSE ? 'worse' : 'not' };
  return { ratio, judgement: sure && ratio >= MUCH_BETTER ? 'better' : 'hardly' };
}

/** 308×, 24×, 3.1×, 0.80× */
export function ratioText(ratio: number): string {
  if (!Number.isFinite(ratio)) return '–';
  return `${ratio >= 10 ? Math.round(ratio) : ratio >= 1 ? ratio.toFixed(1) : ratio.toFixed(2)}×`;
}
