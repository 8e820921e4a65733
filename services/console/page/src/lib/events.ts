// SPDX-License-Identifier: Apache-2.0
// Events and services as people read them: names for codes, what still holds, which tell of the same.
import type { PlainEvent, PlainStatus } from './messages.ts';
import { reasonText } from './verdict.ts';

const MODE = /^mode_[xyz]$/;
const TITLE: Record<string, string> = {
  polarity_reversed: 'Wrong sign',
  double_correction: 'Corrected twice',
  liveliness_lost: 'Fell silent',
  liveliness_regained: 'Speaks again',
  peer_lost: 'Process lost',
  deadline_missed: 'Late',
  incompatible_qos: 'Quality of service does not fit',
  input_stale: 'No samples come',
};

/** A code in words; "mode_x" has none, since its text says the axis and the mode. */
export function eventTitle(code: string): string {
  if (MODE.test(code)) return '';
  const words = code.replaceAll('_', ' ');
  return TITLE[code] ?? words.charAt(0).toUpperCase() + words.slice(1);
}

/** "axis x: frozen (polarity_reversed)" with the reason in words; any other text as it came. */
export function eventText(event: PlainEvent): string {
  if (!MODE.test(event.code)) return event.text;
  return event.text.replace(/ \((\w+)\)$/, (_, reason: string) => (reasonText(reason) ? ` (${reasonText(reason)})` : ''));
}

/** A service's state; one that said that it stops has ended, one that fell silent is gone. */
export function liveness(status: PlainStatus): string {
  if (status.alive) return status.state;
  return status.state === 'stopping' ? 'ended' : 'gone';
}

/** What one death makes several observers say, each naming the dead as "name (pid N)". */
const DEATHS = ['peer_lost', 'liveliness_lost']; // the one that says most first
const OF_A_DEATH = new Set([...DEATHS, 'deadline_missed']);

/** Once a death, where a missed deadline may be told again and again. */
export function tellsOfADeath(event: PlainEvent): boolean {
  return DEATHS.includes(event.code);
}

const DEATH_WITHIN_MS = 30_000; // leases and discovery end within
const OF_ITSELF = /\bthis writer\b/; // one that was only held up finds it out afterwards
const PROCESS = /[\w/:.-]+ \(pid \d+\)/;

/** Events with the deaths folded: `reports` are those of the same one, `observers` who made them. */
export interface FoldedEvent extends PlainEvent {
  observers: string[];
  reports: PlainEvent[];
}

/** Newest first in, newest first out. A silence of somebody who is not lost stays an event of its own. */
export function foldDeaths(events: PlainEvent[]): FoldedEvent[] {
  const deaths: { process: string; row: FoldedEvent; atMs: number }[] = [];
  const deathOf = (e: PlainEvent) => {
    if (!OF_A_DEATH.has(e.code)) return undefined;
    const process = PROCESS.exec(e.text)?.[0];
    const isOf = (d: { process: string }) => (process === undefined ? OF_ITSELF.test(e.text) && d.process.startsWith(`${e.service} (pid `) : d.process === process);
    return deaths.find((d) => isOf(d) && Math.abs(d.atMs - e.atMs) <= DEATH_WITHIN_MS);
  };
  for (const code of DEATHS) {
    for (const e of events) {
      const process = e.code === code ? PROCESS.exec(e.text)?.[0] : undefined;
      if (process !== undefined && !deathOf(e)) deaths.push({ process, row: { ...e, observers: [], reports: [] }, atMs: e.atMs });
    }
  }
  const rows: FoldedEvent[] = [];
  for (const e of events) {
    const death = deathOf(e);
    if (!death) {
      rows.push({ ...e, observers: [e.service], reports: [e] });
      continue;
    }
    if (death.row.reports.length === 0) rows.push(death.row);
    death.row.reports.push(e);
    if (!death.row.observers.includes(e.service)) death.row.observers.push(e.service);
  }
  return rows;
}
