// SPDX-License-Identifier: Apache-2.0
import type { Ring } from './ring.ts';

/** Why raw and compensated can't be compared now. */
export type Obstacle = 'passthrough' | 'holding' | 'motion' | 'short';

/** Standard deviation of means over blocks of equal time: what is left once white noise is averaged out. */
export interface BlockSpread {
  blocks: number;
  raw: number; // deg/h
  compensated: number; // deg/h
  against: 'rest' | 'reference';
}

export type Comparison = BlockSpread | { obstacle: Obstacle };

/** Columns of one-second rows: rates in deg/h, NaN where the true rate is unknown; mode as in telemetry.proto. */
export interface RateColumns {
  raw: number;
  compensated: number;
  reference: number;
  mode: number;
}

const SHARE_OF_BLOCK = 0.8; // that must be filled for a block to count
const FEWEST_BLOCKS = 3;
// A block in which the raw rate moves so much more than in the quietest one holds motion, not drift.
const MOTION_RATIO = 5;
const MOTION_DEG_H = 5;

const PASSTHROUGH = 0;
const LEARNING = 1;
const FALLBACK = 3;
const HOLDING = 5;

interface Block {
  raw: number; // means
  compensated: number;
  within: number; // standard deviation of the raw rows in it
  certain: boolean; // it learned in there, or the true rate is known
}

function deviation(values: number[]): number {
  const mean = values.reduce((sum, v) => sum + v, 0) / values.length;
  return Math.sqrt(values.reduce((sum, v) => sum + (v - mean) ** 2, 0) / (values.length - 1));
}

function atRest(blocks: Block[]): Block[] {
  const certain = blocks.filter((block) => block.certain);
  const quiet = Math.min(...(certain.length > 0 ? certain : blocks).map((block) => block.within));
  return blocks.filter((block) => block.within <= Math.max(MOTION_RATIO * quiet, MOTION_DEG_H));
}

/** The first row after the last step that is no drift: from passthrough, and from the mean held until the first model. */
function firstComparable(ring: Ring, modeColumn: number): number | Obstacle {
  const mode = (i: number) => ring.columns[modeColumn][ring.slot(i)];
  let first = ring.size;
  while (first > 0 && mode(first - 1) !== PASSTHROUGH) --first;
  if (first === 0) return 0;
  if (first === ring.size) return 'passthrough';
  while (first < ring.size && (mode(first) === FALLBACK || mode(first) === HOLDING)) ++first;
  return first < ring.size ? first + 1 : 'holding'; // the step itself is within a row
}

function blocksOf(ring: Ring, first: number, columns: RateColumns, blockS: number): Block[] {
  const blocks: Block[] = [];
  let at = NaN;
  let raw: number[] = [];
  let compensatedSum = 0;
  let certain = false;
  const close = () => {
    if (raw.length < SHARE_OF_BLOCK * blockS) return;
    const mean = raw.reduce((sum, v) => sum + v, 0) / raw.length;
    blocks.push({ raw: mean, compensated: compensatedSum / raw.length, within: deviation(raw), certain });
  };
  for (let i = first; i < ring.size; ++i) {
    const slot = ring.slot(i);
    const block = Math.floor(ring.time[slot] / (blockS * 1e9));
    if (block !== at) {
      close();
      at = block;
      raw = [];
      compensatedSum = 0;
      certain = false;
    }
    const r = ring.columns[columns.raw][slot];
    const c = ring.columns[columns.compensated][slot];
    const reference = ring.columns[columns.reference][slot];
    const known = Number.isFinite(reference) ? reference : 0;
    if (Number.isFinite(reference) || ring.columns[columns.mode][slot] === LEARNING) certain = true;
    if (Number.isFinite(r) && Number.isFinite(c)) {
      raw.push(r - known);
      compensatedSum += c - known;
    }
  }
  close();
  return blocks;
}

/**
 * Spread of the block means of raw and compensated rate, over all rows since the last step that is no drift. The true
 * rate, where known, is taken off both; blocks of motion are left out, and those that are not filled to four fifths in
 * both columns. `moves`: it is in motion now, and unless some block is known to be at rest, all of them may be.
 */
export function blockSpread(ring: Ring, columns: RateColumns, blockS: number, moves = false): Comparison {
  const first = firstComparable(ring, columns.mode);
  if (typeof first === 'string') return { obstacle: first };
  const blocks = blocksOf(ring, first, columns, blockS);
  const counted = atRest(blocks);
  if (counted.length < FEWEST_BLOCKS) return { obstacle: blocks.length > counted.length ? 'motion' : 'short' };
  if (moves && !counted.some((block) => block.certain)) return { obstacle: 'motion' };
  const spread = { raw: deviation(counted.map((block) => block.raw)), compensated: deviation(counted.map((block) => block.compensated)) };
  if (!(spread.compensated > 0)) return { obstacle: 'short' };
  const known = Number.isFinite(ring.columns[columns.reference][ring.slot(ring.size - 1)]);
  return { ...spread, blocks: counted.length, against: known ? 'reference' : 'rest' };
}

/** The p-quantile (nearest rank) of the first `count` of `values`; NaN when there are none. */
export function quantile(values: Float64Array, count: number, p: number): number {
  if (count === 0) return NaN;
  const sorted = values.slice(0, count).sort();
  return sorted[Math.min(count - 1, Math.max(0, Math.ceil(p * count) - 1))];
}
