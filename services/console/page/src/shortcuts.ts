// SPDX-License-Identifier: Apache-2.0
// One key, one action; the help dialog lists this table. They can be switched off there.
import type { LiveView } from './charts/live_view.svelte.ts';
import { TABS, type ConsoleState } from './state.svelte.ts';
import { THEMES, applyTheme, storedTheme } from './theme.ts';

export interface Actions {
  console: ConsoleState;
  view: LiveView;
  openCommands: () => void;
  openHelp: () => void;
}

interface Shortcut {
  keys: string[];
  shown: string;
  does: string;
  run: (actions: Actions, key: string) => void;
}

const PAN = 0.2;
const ZOOM = 1.6;
const OFF_KEY = 'zerodrift.shortcuts';

export const SHORTCUTS: Shortcut[] = [
  { keys: ['1', '2', '3', '4', '5', '6'], shown: '1 – 6', does: 'go to a view', run: ({ console }, key) => (console.tab = TABS[Number(key) - 1]) },
  { keys: [' '], shown: 'Space', does: 'pause the charts, or follow again', run: ({ view }) => view.pause() },
  { keys: ['+', '='], shown: '+', does: 'zoom in', run: ({ view }) => view.zoom(1 / ZOOM) },
  { keys: ['-'], shown: '−', does: 'zoom out', run: ({ view }) => view.zoom(ZOOM) },
  { keys: ['ArrowLeft'], shown: '←', does: 'earlier', run: ({ view }) => view.pan(-PAN) },
  { keys: ['ArrowRight'], shown: '→', does: 'later', run: ({ view }) => view.pan(PAN) },
  { keys: ['0'], shown: '0', does: 'reset the window', run: ({ view }) => view.reset() },
  { keys: ['x', 'y', 'z'], shown: 'x y z', does: 'one axis, or all again', run: ({ console }, key) => (console.axis = console.axis === 'xyz'.indexOf(key) ? 'all' : ('xyz'.indexOf(key) as 0 | 1 | 2)) },
  { keys: ['e'], shown: 'e', does: 'show least and greatest, or not', run: ({ view }) => { view.envelope = !view.envelope; view.refresh(); } },
  { keys: ['a'], shown: 'a', does: 'average over more', run: ({ view }) => view.nextAverage() },
  { keys: ['s'], shown: 's', does: 'save the visible range as CSV', run: ({ view }) => view.exportCsv() },
  { keys: ['g'], shown: 'g', does: 'next gyro', run: ({ console }) => console.gyros.length > 1 && console.select(console.gyros[(console.gyros.indexOf(console.selected) + 1) % console.gyros.length]) },
  { keys: ['c'], shown: 'c', does: 'command', run: ({ openCommands }) => openCommands() },
  { keys: ['t'], shown: 't', does: 'next theme', run: () => applyTheme(THEMES[(THEMES.indexOf(storedTheme()) + 1) % THEMES.length]) },
  { keys: ['?'], shown: '?', does: 'this help', run: ({ openHelp }) => openHelp() },
];

export function shortcutsOn(): boolean {
  try {
    return localStorage.getItem(OFF_KEY) !== 'off';
  } catch {
    return true;
  }
}

export function setShortcuts(on: boolean): void {
  try {
    localStorage.setItem(OFF_KEY, on ? 'on' : 'off');
  } catch {
    // then they stay on
  }
}

const TYPING = 'input, select, textarea, [contenteditable]';
const PRESSED = 'button, a, summary, [role=tab]';

export function takeKey(event: KeyboardEvent, actions: Actions): void {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
  const target = event.target as Element | null;
  // The focus leaves a dialog that was closed with the next picture only.
  const at = target?.closest('dialog') ? null : target;
  if (at?.closest(TYPING) || (event.key === ' ' && at?.closest(PRESSED))) return;
  const shortcut = SHORTCUTS.find((s) => s.keys.includes(event.key));
  if (!shortcut) return;
  event.preventDefault();
  shortcut.run(actions, event.key);
}
