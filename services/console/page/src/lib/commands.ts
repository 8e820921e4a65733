// SPDX-License-Identifier: Apache-2.0
// What can be commanded from here, to whom, and how the argument is spelt.
import type { Outcome } from './messages.ts';

export interface CommandKind {
  name: string;
  title: string;
  to: string; // begin of the services' names
  toAll: boolean; // every publisher gets it
  does: string;
  asks: 'nothing' | 'checkpoint' | 'injection' | 'replay';
}

export const COMMANDS: CommandKind[] = [
  { name: 'freeze', title: 'Freeze', to: 'compensation', toAll: false, does: 'Stops learning on every axis. The present model goes on compensating.', asks: 'nothing' },
  { name: 'learn', title: 'Learn', to: 'compensation', toAll: false, does: 'Learns again whenever it is at rest or a reference is there.', asks: 'nothing' },
  { name: 'reset', title: 'Reset', to: 'compensation', toAll: false, does: 'Forgets all that was learned. This cannot be undone without a checkpoint.', asks: 'nothing' },
  { name: 'checkpoint', title: 'Checkpoint', to: 'compensation', toAll: false, does: "Saves what was learned in the service's checkpoint folder.", asks: 'checkpoint' },
  { name: 'restore', title: 'Restore', to: 'compensation', toAll: false, does: 'Goes on with what was saved. The present model is replaced.', asks: 'checkpoint' },
  { name: 'inject', title: 'Inject a fault', to: 'gyro_publisher', toAll: false, does: 'Adds a fault to the published raw rates, to see what the system makes of it.', asks: 'injection' },
  { name: 'replay', title: 'Replay', to: 'gyro_publisher', toAll: true, does: 'Pauses, resumes or paces a record or simulation.', asks: 'replay' },
];

export interface Injection {
  kind: 'step' | 'noise' | 'stuck' | 'gap' | 'clear';
  axis: 'x' | 'y' | 'z' | 'xyz'; // a gap is on all
  magnitude: number; // deg/h; of stuck and gap: 0
  seconds: number;
}

/** kind:axis:magnitude:seconds; clear ends what acts. */
export function injectionArgument({ kind, axis, magnitude, seconds }: Injection): string {
  if (kind === 'clear') return 'clear';
  const size = kind === 'stuck' || kind === 'gap' ? 0 : magnitude;
  return `${kind}:${kind === 'gap' ? 'xyz' : axis}:${size}:${seconds}`;
}

/** Names of the services there that a command can go to; the default one where none is. */
export function addressees(kind: CommandKind, services: string[]): string[] {
  const there = services.filter((s) => !s.includes(':') && (s === kind.to || s.startsWith(`${kind.to}/`)));
  return there.length > 0 ? there : [kind.to];
}

const PUBLISHERS = ['gyro_publisher', 'thermal_publisher'];

/** All publishers that reported: a replay keeps its streams together. */
export function publishers(services: string[]): string[] {
  const there = services.filter((s) => !s.includes(':') && PUBLISHERS.includes(s.split('/')[0]));
  return there.length > 0 ? there : PUBLISHERS;
}

const OUTCOME_TEXT: Record<Outcome, string> = { done: 'Done', refused: 'Refused', unanswered: 'Not answered' };

export function outcomeText(outcome: Outcome): string {
  return OUTCOME_TEXT[outcome];
}
