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

/** The page's tabs, in the order of the keys 1 to 6. */
export const TABS = ['live', 'allan', 'health', 'twin', 'navigation', 'events'];

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

/** The four answers and the banner as page/tests/tour.test.ts writes them: '✓ Good: live, none missing'. Read in one step. */
export function headline(page) {
  return page.evaluate(() => {
    const text = (node) => node?.textContent.replace(/\s+/g, ' ').trim() ?? '';
    const part = (id) => document.querySelector(`[data-testid="${id}"]`);
    const answer = (id) => {
      const tile = part(`verdict-${id}`);
      const glyph = text(tile?.querySelector('.glyph'));
      return `${glyph} ${text(tile?.querySelector('.answer')).slice(glyph.length)}: ${text(tile?.querySelector('.detail'))}`;
    };
    const [, what, when] = (part('stale') ?? part('gone'))?.querySelectorAll(':scope > span') ?? []; // the first is its glyph
    const banner = part('stale') && when ? `${text(what)} ${text(when)}` : text(what); // a gateway's is followed by the next attempt
    return { compensating: answer('compensating'), better: answer('better'), learning: answer('learning'), data: answer('data'), banner };
  });
}

/** What stands for a figure that is another one each time. */
const FIGURES = {
  age: '[\\d.]+ (ms|s|min)',
  count: '\\d+',
  pace: '[\\d.]+',
  ratio: '([\\d.]+–)?[\\d.]+×',
};

function pattern(words) {
  const literal = words.replace(/[\\^$.*+?()[\]|]/g, '\\$&');
  return new RegExp(`^${literal.replace(/\{(\w+)\}/g, (_, figure) => FIGURES[figure])}$`);
}

/** Waits until all of `words` are said at once, to the letter but for {age}, {count}, {pace} and {ratio}; no banner where none is given. */
export async function said(page, words, withinMs = 20_000) {
  const wanted = Object.entries({ banner: '', ...words }).map(([id, text]) => [id, pattern(text)]);
  const end = Date.now() + withinMs;
  for (;;) {
    const says = await headline(page);
    const others = wanted.filter(([id, holds]) => !holds.test(says[id])).map(([id]) => id);
    if (others.length === 0) return says;
    if (Date.now() > end) {
      throw new Error(others.map((id) => `${id}: still '${says[id]}' after ${withinMs / 1000} s, expected '${words[id] ?? ''}'`).join('\n'));
    }
    await page.waitForTimeout(50);
  }
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
