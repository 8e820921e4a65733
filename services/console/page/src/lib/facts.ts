// SPDX-License-Identifier: Apache-2.0
// From what the page was told to the facts that the headline speaks of: the same for the gyro that is shown, whose
// samples come here, and for the others, of which the gateway tells once a second.
import { causes, correctedTwice, hasFinished, isCompensationGone } from './cause.ts';
import type { GyroSummary, Live, PlainStatus } from './messages.ts';
import { staleAfterS, type AxisFacts, type Facts, type Link } from './verdict.ts';

/** A count that began before this page listened has no time of its own. */
export interface Losses {
  missing: number;
  sinceMs: number;
  seen: boolean; // it grew while this page listened
}

export interface Known {
  link: Link;
  linkSinceMs: number;
  nowMs: number;
  gatewayAheadMs: number; // its clock before this page's
  live: Live | undefined;
  fleet: GyroSummary[];
  losses: ReadonlyMap<number, Losses>;
  acknowledgedMs: number; // losses until then; NaN: none
  dropped: number;
  services: PlainStatus[];
}

export const TOLD_WITHIN_S = 3; // the gateway tells once a second; then its word is old

export function grownLosses(known: Losses | undefined, missing: number, nowMs: number): Losses {
  if (known !== undefined && missing <= known.missing) return { ...known, missing }; // a late answer filled a hole
  return { missing, sinceMs: nowMs, seen: known !== undefined };
}

function ageS(summary: GyroSummary, nowMs: number): number {
  const toldS = Math.max(0, nowMs - summary.arrivedMs) / 1000;
  const wasSilent = summary.ageS > staleAfterS(summary.sampleIntervalS); // else samples came since, as far as is known
  return wasSilent || toldS > TOLD_WITHIN_S ? summary.ageS + toldS : summary.ageS;
}

const NO_AXIS: AxisFacts = { valid: false, mode: 0, reason: '', comparison: { obstacle: 'unknown' }, harmed: false };

export function factsOf(known: Known, gyro: number): Facts {
  const { nowMs, gatewayAheadMs, services } = known;
  const summary = known.fleet.find((s) => s.gyro === gyro);
  const live = known.live?.gyro === gyro ? known.live : undefined;
  const newest = live ?? summary;
  const losses = known.losses.get(gyro);
  return {
    link: known.link,
    linkS: (nowMs - known.linkSinceMs) / 1000,
    known: gyro !== 0,
    present: newest !== undefined,
    ageS: live ? Math.max(0, nowMs - live.arrivedMs) / 1000 : summary ? ageS(summary, nowMs) : NaN,
    behindS: known.live?.behindS ?? 0,
    sampleIntervalS: newest?.sampleIntervalS ?? NaN,
    finished: hasFinished(services, gyro),
    compensationGone: isCompensationGone(services),
    pace: newest?.pace ?? NaN,
    missing: newest?.missing ?? 0,
    lossAgeS: (nowMs - (losses?.sinceMs ?? NaN)) / 1000,
    lossSeen: losses?.seen ?? false,
    lossAcknowledged: (losses?.sinceMs ?? NaN) <= known.acknowledgedMs,
    dropped: known.dropped,
    correctedTwice: correctedTwice(services, gyro),
    blockS: summary?.blockS ?? NaN,
    causes: causes(services, gyro, nowMs + gatewayAheadMs),
    axes: [0, 1, 2].map((a) => {
      const told = summary?.axes[a] ?? NO_AXIS;
      const { valid, mode, reason } = live?.axes[a] ?? told;
      return { ...told, valid, mode, reason };
    }),
  };
}
