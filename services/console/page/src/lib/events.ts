// SPDX-License-Identifier: Apache-2.0
// Events as people read them: names for codes, and which of them still hold.
import type { PlainEvent, PlainStatus } from './messages.ts';
import { reasonText } from './verdict.ts';

const TITLE: Record<string, string> = {
  polarity_reversed: 'Wrong sign',
  double_correction: 'Corrected twice',
};

/** A code in words; one that isn't known here as it came. */
export function eventTitle(code: string): string {
  return TITLE[code] ?? code;
}

/** "axis x: frozen (polarity_reversed)" with the reason in words; any other text as it came. */
export function eventText(event: PlainEvent): string {
  if (!/^mode_[xyz]$/.test(event.code)) return event.text;
  return event.text.replace(/ \((\w+)\)$/, (_, reason: string) => (reasonText(reason) ? ` (${reasonText(reason)})` : ''));
}

const CLOCK_MS = 1000; // an event of a service's first moments

/** When the compensation said last that a gyro is given its own output; its next start takes that back. NaN: it didn't. */
export function correctedTwiceMs(events: PlainEvent[], services: PlainStatus[], gyro: number): number {
  const told = events.filter((e) => {
    if (e.code !== 'double_correction' || e.gyro !== gyro) return false;
    const process = services.find((s) => s.service === e.service);
    return process !== undefined && e.atMs > process.atMs - process.uptimeS * 1000 - CLOCK_MS;
  });
  return told.length > 0 ? Math.max(...told.map((e) => e.atMs)) : NaN;
}
