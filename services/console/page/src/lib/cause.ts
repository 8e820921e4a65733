// SPDX-License-Identifier: Apache-2.0
// Why no sample comes: who of a gyro's chain died or ended, or what the compensation itself reports. Only what is known
// for certain; a service that is one of several is no cause while another of them is there.
import { liveness } from './events.ts';
import type { PlainStatus } from './messages.ts';
import { ageText } from './scale.ts';
import type { Cause } from './verdict.ts';

const PUBLISHERS = ['gyro_publisher', 'replay'];

/** "compensation/2:1": instance 2 of compensation, about gyro 1. */
function parsed(service: string): { name: string; part: string } {
  const [whole, part = ''] = service.split(':');
  return { name: whole.split('/')[0], part };
}

/** What a service says of a gyro apart: 0 is any. */
function ofGyro(services: PlainStatus[], names: string[], gyro: number): PlainStatus[] {
  return services.filter((s) => {
    const { name, part } = parsed(s.service);
    return names.includes(name) && (gyro === 0 ? /^\d+$/.test(part) : part === String(gyro));
  });
}

/** The source says that it has ended: a record or a simulation was published to its end. */
export function hasFinished(services: PlainStatus[], gyro: number): boolean {
  const publishers = ofGyro(services, PUBLISHERS, gyro);
  const newest = publishers.reduce<PlainStatus | undefined>((a, b) => (a && a.atMs >= b.atMs ? a : b), undefined);
  return (newest?.metrics.find((m) => m.name === 'finished')?.value ?? 0) > 0;
}

/** Axes that a compensation says it is given its own output of. */
export function correctedTwice(services: PlainStatus[], gyro: number): number[] {
  const metrics = ofGyro(services, ['compensation'], gyro).flatMap((s) => (s.alive ? s.metrics : []));
  return ['x', 'y', 'z'].flatMap((axis, a) => (metrics.some(({ name, value }) => name === `own_output_${axis}` && value > 0) ? [a] : []));
}

/** Of those who do the same, the one that went last, where none is left. */
function lastGone(services: PlainStatus[], nowMs: number): (Cause & { atMs: number })[] {
  if (services.length === 0 || services.some((s) => s.alive)) return [];
  const last = services.reduce((a, b) => (a.atMs >= b.atMs ? a : b));
  const who = `${last.service.split(':')[0]} (host ${last.host}, pid ${last.processId})`;
  const ago = ageText(Math.max(0, nowMs - last.atMs) / 1000);
  const [what, when] = liveness(last) === 'ended' ? [`${who} has ended`, `${ago} ago`] : [`${who} is gone`, `since ${ago}`];
  return [{ what, when, atMs: last.atMs }];
}

function compensationsOf(services: PlainStatus[]): PlainStatus[] {
  return services.filter((s) => /^compensation(\/\d+)?$/.test(s.service));
}

/** No compensation is left, where one was. */
export function isCompensationGone(services: PlainStatus[]): boolean {
  const all = compensationsOf(services);
  return all.length > 0 && !all.some((s) => s.alive);
}

/** Why what a service said is no longer of now: 'x (host h, pid 1) is gone since 3 s'. Empty while one of that name lives, or none was ever there. */
export function goneText(services: PlainStatus[], name: string, nowMs: number): string {
  return lastGone(services.filter((s) => s.service === name), nowMs).map(({ what, when }) => `${what} ${when}`).join('');
}

/** What the compensation reports of the gyro beside its figures. */
function report(services: PlainStatus[], gyro: number): string {
  return ofGyro(services, ['compensation'], gyro).find((s) => s.alive && s.summary !== '')?.summary ?? '';
}

/** Causes of a gyro's silence, the one that began first first; `nowMs` is of the gateway's clock. Gyro 0 is any. */
export function causes(services: PlainStatus[], gyro: number, nowMs: number): Cause[] {
  const says = report(services, gyro);
  const gone = [...lastGone(ofGyro(services, PUBLISHERS, gyro), nowMs), ...lastGone(compensationsOf(services), nowMs)];
  // Without its temperatures only rates that wait for them stop.
  if (says !== '') gone.push(...lastGone(ofGyro(services, ['thermal_publisher'], gyro), nowMs));
  if (gone.length > 0) return gone.sort((a, b) => a.atMs - b.atMs).map(({ what, when }) => ({ what, when }));
  return says === '' ? [] : [{ what: `compensation reports "${says}"`, when: '' }];
}
