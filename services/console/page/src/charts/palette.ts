// SPDX-License-Identifier: Apache-2.0
// Colours of the charts, from the style sheet's custom properties; read anew when the theme changes.

const NAMES = [
  'raw',
  'raw-band',
  'compensated',
  'compensated-band',
  'drift',
  'drift-band',
  'residual',
  'probe-0',
  'probe-1',
  'probe-2',
  'probe-3',
  'measured',
  'twin',
  'repaired',
  'guide',
  'grid',
  'axis',
  'surface',
] as const;
export type Colour = (typeof NAMES)[number];

let palette: Partial<Record<Colour, string>> = {};

export function readPalette(): void {
  const style = getComputedStyle(document.documentElement);
  palette = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--plot-${name}`).trim()]));
}

export function colour(name: Colour): string {
  return palette[name] ?? '#888';
}
