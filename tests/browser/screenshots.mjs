// SPDX-License-Identifier: Apache-2.0
// Makes the pictures of the README and of docs/console.md from the real system: the paper's experiment at 60 times real time.
//   node screenshots.mjs [seconds to run before, default 150]
import { mkdirSync, statSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { part, until } from './browser.mjs';
import { System } from './system.mjs';

const LARGEST_BYTES = 250_000;
const folder = join(dirname(fileURLToPath(import.meta.url)), '../../docs/pictures');
const runS = Number(process.argv[2] ?? 150);

const DESK = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };
const PICTURES = [
  { name: 'console-live-light.png', theme: 'light', key: '1', span: '3600' },
  { name: 'console-live-dark.png', theme: 'dark', key: '1', span: '3600' },
  { name: 'console-allan.png', theme: 'light', key: '2' },
  { name: 'console-health.png', theme: 'light', key: '3' },
  { name: 'console-coverage.png', theme: 'light', key: '1', of: 'coverage' },
  { name: 'console-phone-live.png', theme: 'light', key: '1', span: '3600', size: PHONE },
  { name: 'console-phone-health.png', theme: 'dark', key: '3', size: PHONE },
];

const system = new System();
try {
  mkdirSync(folder, { recursive: true });
  system.startChain({ speed: '60', publisher: process.env.ZERODRIFT_PUBLISHER_OPTIONS?.split(' ') ?? [] });
  await system.startConsole();
  const page = await system.openConsole();
  await until(page, 'verdict-better', (t) => /\d×/.test(t), 120_000);
  await page.waitForTimeout(runS * 1000);
  for (const { name, theme, key, span, of, size = DESK } of PICTURES) {
    await page.emulateMedia({ colorScheme: theme });
    await page.setViewportSize(size);
    await page.keyboard.press(key);
    if (span) await part(page, 'span').selectOption(span);
    await page.evaluate(() => {
      document.activeElement.blur();
      window.scrollTo(0, 0);
    });
    await page.waitForTimeout(2500);
    const path = join(folder, name);
    await (of ? part(page, of) : page).screenshot({ path });
    const bytes = statSync(path).size;
    console.log(`${String(bytes).padStart(8)}  ${path}`);
    if (bytes > LARGEST_BYTES) throw new Error(`${name}: found ${bytes} bytes, expected at most ${LARGEST_BYTES}`);
  }
} finally {
  await system.stopAll();
}
