// SPDX-License-Identifier: Apache-2.0
// Makes the README's pictures from the real system: the paper's experiment at 60 times real time.
//   node screenshots.mjs [seconds to run before, default 150]
import { mkdirSync, statSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { launch, openPage, part, until } from './browser.mjs';
import { System, address } from './system.mjs';

const LARGEST_BYTES = 250_000;
const folder = join(dirname(fileURLToPath(import.meta.url)), '../../docs/pictures');
const runS = Number(process.argv[2] ?? 150);

const PICTURES = [
  { name: 'console-live-light.png', theme: 'light', key: '1', span: '3600' },
  { name: 'console-live-dark.png', theme: 'dark', key: '1', span: '3600' },
  { name: 'console-allan.png', theme: 'light', key: '2' },
  { name: 'console-health.png', theme: 'light', key: '3' },
];

const system = new System();
let browser;
try {
  mkdirSync(folder, { recursive: true });
  system.startChain({ speed: '60', publisher: process.env.ZERODRIFT_PUBLISHER_OPTIONS?.split(' ') ?? [] });
  await system.startConsole();
  browser = await launch();
  const page = await openPage(browser);
  await page.goto(address);
  await until(page, 'verdict-better', (t) => /\d×/.test(t), 120_000);
  await page.waitForTimeout(runS * 1000);
  for (const { name, theme, key, span } of PICTURES) {
    await page.emulateMedia({ colorScheme: theme });
    await page.keyboard.press(key);
    if (span) await part(page, 'span').selectOption(span);
    await page.evaluate(() => document.activeElement.blur());
    await page.waitForTimeout(2500);
    const path = join(folder, name);
    await page.screenshot({ path });
    const { size } = statSync(path);
    console.log(`${String(size).padStart(8)}  ${path}`);
    if (size > LARGEST_BYTES) throw new Error(`${name}: found ${size} bytes, expected at most ${LARGEST_BYTES}`);
  }
} finally {
  await browser?.close();
  await system.stopAll();
}
