// SPDX-License-Identifier: Apache-2.0
// Debian's Chromium, without anything that wants the network.
import { chromium } from 'playwright-core';

const FLAGS = [
  '--headless',
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--enable-precise-memory-info',
  '--js-flags=--expose-gc',
];

export function launch() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: FLAGS });
}

/** A page whose errors are collected: scripts, refused resources, the content security policy. */
export async function openPage(browser, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.problems = [];
  page.on('pageerror', (error) => page.problems.push(error.message));
  page.on('console', (message) => {
    // A socket that cannot connect is told by the browser itself, and is what some tests are about.
    if (message.type() === 'error' && !/WebSocket|ERR_CONNECTION/.test(message.text())) page.problems.push(message.text());
  });
  return page;
}

export const part = (page, id) => page.getByTestId(id);

/** Waits until `holds(text of the part)`; fails with the text it had. */
export async function until(page, id, holds, withinMs = 20_000) {
  const end = Date.now() + withinMs;
  let text = '';
  while (Date.now() < end) {
    text = (await part(page, id).first().textContent({ timeout: withinMs }).catch(() => '')) ?? '';
    if (holds(text)) return text;
    await page.waitForTimeout(100);
  }
  throw new Error(`${id}: still '${text}' after ${withinMs / 1000} s`);
}

/** Pixels of a chart for which `holds` (an expression of r, g, b, a) is true. */
export function pixels(page, selector, holds) {
  // An expression, since the page's content security policy forbids to make functions of text.
  return page.evaluate(`(() => {
    const canvas = document.querySelector(${JSON.stringify(selector)});
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let found = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b, a] = data.subarray(i, i + 4);
      if (${holds}) ++found;
    }
    return found;
  })()`);
}

/** Escape, and the dialog is gone. */
export async function close(page) {
  await page.keyboard.press('Escape');
  await page.locator('dialog[open]').waitFor({ state: 'detached' });
}
