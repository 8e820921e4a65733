// SPDX-License-Identifier: Apache-2.0
/**
 * From the source's writing to this page: both stamps are of the gateway's clock, and this page's takes no part in it. Without the
 * way from the gateway of the sample that waited least. ms
 */
export function sourceToPageMs(publishedNs: bigint, sentNs: bigint, behindS: number): number {
  return Number(sentNs - publishedNs) * 1e-6 + 1000 * behindS;
}

const CLOCKS_APART = 2e-4; // more than the crystals of two computers run apart: what grows no faster is no delay

/** How far behind the gateway samples arrive: they wait where a link or a browser is slower than they come. */
export class DelayMeter {
  private aheadMs = -Infinity; // the gateway's clock before this page's, by the sample that waited least
  private newestMs = -Infinity;
  private markedMs = 0;

  /** `sentMs` by the gateway's clock, in the order of sending; `nowMs` by one that is never set. In s, above that of the sample that waited least. */
  mark(sentMs: number, nowMs: number): number {
    if (sentMs < this.newestMs) this.aheadMs = -Infinity; // the gateway's clock was set back
    this.newestMs = sentMs;
    this.aheadMs = Math.max(this.aheadMs - CLOCKS_APART * (nowMs - this.markedMs), sentMs - nowMs);
    this.markedMs = nowMs;
    return (this.aheadMs - (sentMs - nowMs)) / 1000;
  }
}
