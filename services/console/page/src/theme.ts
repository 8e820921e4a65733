// SPDX-License-Identifier: Apache-2.0
// Light, dark, or as the system has it; remembered by the browser.
import { readPalette } from './charts/palette.ts';

export const THEMES = ['system', 'light', 'dark'] as const;
export type Theme = (typeof THEMES)[number];
const KEY = 'zerodrift.theme';
const systemIsDark = matchMedia('(prefers-color-scheme: dark)');

export function storedTheme(): Theme {
  try {
    const stored = localStorage.getItem(KEY);
    return THEMES.find((theme) => theme === stored) ?? 'system';
  } catch {
    return 'system'; // storage may be forbidden
  }
}

export function applyTheme(theme: Theme): void {
  document.documentElement.dataset.theme = theme === 'system' ? (systemIsDark.matches ? 'dark' : 'light') : theme;
  readPalette();
  window.dispatchEvent(new Event('themechange'));
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // then it isn't remembered
  }
}

systemIsDark.addEventListener('change', () => applyTheme(storedTheme()));
