// SPDX-License-Identifier: Apache-2.0
// What goes wrong in a real system, and the words that the page has for it; page/tests/tour.test.ts has them for more.
import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { violations } from './axe.mjs';
import { launch, openPage, part, until } from './browser.mjs';
import { System, address } from './system.mjs';

const START_MS = 60_000;
const LEASES_MS = 60_000; // until the middleware gives a dead process up

describe('a chain of which one after the other fails', () => {
  const system = new System();
  let browser;
  let page;
  before(async () => {
    await system.startConsole();
    browser = await launch();
    page = await openPage(browser);
    await page.goto(address);
    system.startChain({ speed: '10', parts: ['gyro_publisher'] });
  });
  after(async () => {
    await browser?.close();
    await system.stopAll();
  });

  test('without a thermometer it says what the compensation waits for', async () => {
    const reports = /compensation reports "rates wait for temperatures; is thermal_publisher running\?"/;
    await until(page, 'verdict-data', (t) => /No sample yet/.test(t) && reports.test(t), START_MS);
    await until(page, 'stale', (t) => reports.test(t) && /: no sample comes\./.test(t));
    await until(page, 'no-gyro', (t) => reports.test(t));
    system.startGyro({ speed: '10', parts: ['thermal_publisher'] });
    await until(page, 'verdict-data', (t) => /Good/.test(t), START_MS);
    await until(page, 'verdict-compensating', (t) => /✓\s*Compensating/.test(t), START_MS);
    assert.equal(await part(page, 'stale').count(), 0);
  });

  test('a refused command is called refused, with the reason, and changes no answer', async () => {
    await page.keyboard.press('c');
    await page.getByLabel('Restore', { exact: true }).check();
    await part(page, 'checkpoint-name').fill('nobody_saved_this');
    await part(page, 'send').click();
    await until(page, 'reply', (t) => /Refused compensation: .*nobody_saved_this/.test(t));
    await page.keyboard.press('Escape');
    await until(page, 'verdict-data', (t) => /Good/.test(t));
  });

  test('a compensation that is killed is named, and one that is started again ends that', async () => {
    const dead = `compensation \\(host [^,]+, pid ${system.pid('compensation')}\\) is gone`;
    await system.stop('compensation', 'SIGKILL');
    await until(page, 'stale', (t) => new RegExp(`${dead}: no sample comes any more.*since`).test(t));
    await until(page, 'verdict-data', (t) => new RegExp(`Stale: .* old.*${dead} since`).test(t));
    system.startCompensation();
    await until(page, 'verdict-data', (t) => /Good|With losses/.test(t), LEASES_MS);
    await until(page, 'verdict-compensating', (t) => /✓\s*Compensating/.test(t), START_MS);
    await page.keyboard.press('3');
    const pid = system.pid('compensation');
    await until(page, 'services', (t) => new RegExp(`compensation[^]*, ${pid}`).test(t));
    assert.equal(await part(page, 'stale').count(), 0);
  });

  test('a thermal_publisher that is killed is named while rates wait for it', async () => {
    const dead = `thermal_publisher \\(host [^,]+, pid ${system.pid('thermal_publisher')}\\) is gone`;
    await system.stop('thermal_publisher', 'SIGKILL');
    await until(page, 'stale', (t) => new RegExp(`${dead}: no sample comes any more; everything shown is old`).test(t), START_MS);
    await until(page, 'verdict-data', (t) => new RegExp(`Stale: .* old.*${dead} since`).test(t));
    await until(page, 'verdict-compensating', (t) => /Not known now.*last known: Compensating/.test(t));
    // Once the middleware has given it up, rates are answered without.
    await until(page, 'verdict-data', (t) => /Good|With losses/.test(t), LEASES_MS);
    assert.equal(await part(page, 'stale').count(), 0);
  });

  test('no script failed', () => assert.deepEqual(page.problems, []));
});

describe('ten gyros', () => {
  const system = new System();
  const ids = Array.from({ length: 10 }, (_, i) => i + 1);
  let browser;
  let page;
  before(async () => {
    await system.startConsole();
    browser = await launch();
    page = await openPage(browser);
    await page.goto(address);
    system.startCompensation();
    for (const id of ids) system.startGyro({ id, publisher: ['--rate', '20'] });
  });
  after(async () => {
    await browser?.close();
    await system.stopAll();
  });

  test('each has its four answers in the strip', async () => {
    for (const id of ids) {
      await until(page, `fleet-${id}-data`, (t) => /✓\s*Good$/.test(t), START_MS);
      await until(page, `fleet-${id}-compensating`, (t) => /●\s*Not compensating yet|✓\s*Compensating/.test(t));
      await until(page, `fleet-${id}-better`, (t) => /·\s*Not comparable yet/.test(t));
      await until(page, `fleet-${id}-learning`, (t) => /Learning|Not learning|Frozen/.test(t));
    }
    assert.equal(await part(page, 'fleet').locator('button').count(), ids.length);
  });

  test('the dead publisher of one is said of that one alone, and named once it is chosen', async () => {
    const pid = system.pid('gyro_publisher:7');
    await system.stop('gyro_publisher:7', 'SIGKILL');
    await until(page, 'fleet-7-data', (t) => /✕\s*Stale/.test(t));
    await until(page, 'fleet-7-compensating', (t) => /·\s*Not known now/.test(t));
    for (const id of ids.filter((id) => id !== 7)) await until(page, `fleet-${id}-data`, (t) => /✓\s*Good$/.test(t));
    assert.equal(await part(page, 'stale').count(), 0);
    await part(page, 'fleet-7').focus();
    await page.keyboard.press('Enter');
    await until(page, 'stale', (t) => new RegExp(`gyro_publisher \\(host [^,]+, pid ${pid}\\) is gone: no sample comes any more`).test(t));
    assert.equal(await part(page, 'fleet-7').getAttribute('aria-pressed'), 'true');
    assert.equal(await part(page, 'gyro').inputValue(), '7');
    await part(page, 'fleet-3').click();
    await until(page, 'verdict-data', (t) => /Good/.test(t));
    assert.equal(await part(page, 'stale').count(), 0);
  });

  for (const width of [1440, 390]) {
    test(`the strip fits into ${width} pixels, is within reach of the keyboard and has no violation`, async () => {
      await page.setViewportSize({ width, height: 844 });
      const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(beyond <= 0, `${beyond} pixels reach beyond the screen`);
      await part(page, 'fleet-1').focus();
      await part(page, 'fleet-10').focus();
      const inside = await page.evaluate(() => {
        const strip = document.querySelector('[data-testid="fleet"]').getBoundingClientRect();
        const at = document.activeElement.getBoundingClientRect();
        return at.top >= strip.top - 1 && at.bottom <= strip.bottom + 1 && strip.height <= innerHeight / 3;
      });
      assert.ok(inside, 'what has the focus is scrolled into the strip');
      const found = await violations(page);
      assert.deepEqual(found.filter((v) => ['serious', 'critical'].includes(v.impact)).map((v) => `${v.id}: ${v.nodes[0].html}`), []);
    });
  }

  test('no script failed', () => assert.deepEqual(page.problems, []));
});
