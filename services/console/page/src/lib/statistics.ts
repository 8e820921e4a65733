// SPDX-License-Identifier: Apache-2.0
import type { Ring } from './ring.ts';

/** Standard deviation of means over blocks of equal time: what is left once white noise is averaged out. */
export interface BlockSpread {
  blockS: number;
  blocks: number;
  raw: number;
  compensated: number;
}

const SHARE_OF_BLOCK = 0.8; // that must be filled for a block to count
const FEWEST_BLOCKS = 3;
// A block in which the raw rate moves so much more than in the quietest one holds motion, not drift.
const MOTION_RATIO = 5;
const MOTION_DEG_H = 5;

interface Block {
  raw: number; // means
  compensated: number;
  within: number; // standard deviation of the raw rows in it
}

function deviation(values: number[]): number {
  const mean = values.reduce((sum, v) => sum + v, 0) / values.length;
  return Math.sqrt(values.reduce((sum, v) => sum + (v - mean) ** 2, 0) / (values.length - 1));
}

function atRest(blocks: Block[]): Block[] {
  const quiet = Math.min(...blocks.map((block) => block.within));
  return blocks.filter((block) => block.within <= Math.max(MOTION_RATIO * quiet, MOTION_DEG_H));
}

/**
 * Spread of the block means of two columns of one-second rows, deg/h, over the newest `spanS` seconds. The true rate,
 * where the third column has it, is taken off both; blocks of motion are left out, and those that are not filled to
 * four fifths in both columns. Nothing with fewer than three blocks.
 */
export function blockSpread(
  ring: Ring,
  rawColumn: number,
  compensatedColumn: number,
  referenceColumn: number,
  blockS: number,
  spanS: number,
): BlockSpread | undefined {
  const blockNs = blockS * 1e9;
  const blocks: Block[] = [];
  let at = NaN;
  let raw: number[] = [];
  let compensatedSum = 0;
  const close = () => {
    if (raw.length < SHARE_OF_BLOCK * blockS) return;
    const mean = raw.reduce((sum, v) => sum + v, 0) / raw.length;
    blocks.push({ raw: mean, compensated: compensatedSum / raw.length, within: deviation(raw) });
  };
  for (let i = ring.lowerBound(ring.newest - spanS * 1e9); i < ring.size; ++i) {
    const slot = ring.slot(i);
    const block = Math.floor(ring.time[slot] / blockNs);
    if (block !== at) {
      close();
      at = block;
      raw = [];
      compensatedSum = 0;
    }
    const r = ring.columns[rawColumn][slot];
    const c = ring.columns[compensatedColumn][slot];
    const reference = ring.columns[referenceColumn][slot];
    const known = Number.isFinite(reference) ? reference : 0;
    if (Number.isFinite(r) && Number.isFinite(c)) {
      raw.push(r - known);
      compensatedSum += c - known;
    }
  }
  close();
  const quiet = atRest(blocks);
  if (quiet.length < FEWEST_BLOCKS) return undefined;
  return {
    blockS,
    blocks: quiet.length,
    raw: deviation(quiet.map((block) => block.raw)),
    compensated: deviation(quiet.map((block) => block.compensated)),
  };
}

/** The p-quantile (nearest rank) of the first `count` of `values`; NaN when there are none. */
export function quantile(values: Float64Array, count: number, p: number): number {
  if (count === 0) return NaN;
  const sorted = values.slice(0, count).sort();
  return sorted[Math.min(count - 1, Math.max(0, Math.ceil(p * count) - 1))];
}
