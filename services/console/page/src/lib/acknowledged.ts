// SPDX-License-Identifier: Apache-2.0
// What somebody has seen of errors and losses. Kept in the browser for one run of the gateway, so that a reload keeps it
// and a new run begins with nothing seen.
import { tellsOfADeath, type FoldedEvent } from './events.ts';
import type { PlainEvent } from './messages.ts';

/** Stamp of the newest event seen, by the service that stamped it: clocks of two hosts are never compared. */
export interface Seen {
  services: Record<string, number>;
  lossesMs: number; // up to when missing samples were seen, by this browser's clock; NaN: never
}

export const NOTHING_SEEN: Seen = { services: {}, lossesMs: NaN };

export function acknowledged(events: PlainEvent[], before: Seen, nowMs: number): Seen {
  const services = { ...before.services };
  for (const e of events) services[e.service] = Math.max(services[e.service] ?? -Infinity, e.atMs);
  return { services, lossesMs: nowMs };
}

/** A death is seen with the first of its reports that was: who reports it later adds nothing new, who reports it again does. */
export function isSeen(row: FoldedEvent, seen: Seen): boolean {
  const isKnown = (e: PlainEvent) => e.atMs <= (seen.services[e.service] ?? -Infinity);
  const known = row.reports.filter(isKnown);
  const isAgain = (e: PlainEvent) => tellsOfADeath(e) && known.some((k) => k.service === e.service && k.code === e.code && k.text === e.text);
  return known.length > 0 && !row.reports.some((e) => !isKnown(e) && isAgain(e));
}

const LOSSES = new Set(['missing_sample', 'sample_lost', 'sample_rejected', 'peer_lost', 'liveliness_lost']);

/** "2 errors, 1 loss": what the badge says of rows that nobody has seen; empty where there is none. */
export function unseenText(rows: FoldedEvent[], seen: Seen): string {
  const unseen = rows.filter((row) => !isSeen(row, seen));
  const errors = unseen.filter((row) => row.severity === 2).length;
  const losses = unseen.filter((row) => row.severity !== 2 && LOSSES.has(row.code)).length;
  const counted = (n: number, one: string, many: string) => (n === 0 ? [] : [`${n} ${n === 1 ? one : many}`]);
  return [...counted(errors, 'error', 'errors'), ...counted(losses, 'loss', 'losses')].join(', ');
}

const KEY = 'zerodrift.acknowledged';
type Store = () => Pick<Storage, 'getItem' | 'setItem'>; // asking for it may be forbidden

/** `session`: the gateway's name for its run. */
export function storedSeen(store: Store, session: string): Seen {
  try {
    const kept: unknown = JSON.parse(store().getItem(KEY) ?? 'null');
    if (typeof kept !== 'object' || kept === null || !('session' in kept) || kept.session !== session) return NOTHING_SEEN;
    const { services, lossesMs } = kept as unknown as Seen;
    return { services: { ...services }, lossesMs: lossesMs ?? NaN };
  } catch {
    return NOTHING_SEEN;
  }
}

export function storeSeen(store: Store, session: string, seen: Seen): void {
  try {
    store().setItem(KEY, JSON.stringify({ session, ...seen }));
  } catch {
    // then it isn't remembered
  }
}
