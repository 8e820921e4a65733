// SPDX-License-Identifier: Apache-2.0
// The console's views, each with something to show: whole at both widths, without a finding of axe, and what they say.
import { violations as examinePage } from './axe.mjs';
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { close, part, pixels, TABS, until } from './browser.mjs';
import { System, config } from './system.mjs';

const SIZES = [
  { width: 1440, height: 900 },
  { width: 390, height: 844 }, // a phone
];

describe('the views of the console', () => {
  const system = new System();
  let page;

  before(async () => {
    // Two hours with the true rate beside the measured one: twelve minutes at this speed.
    const record = await system.simulate(join(config, 'models/paper_fog.yaml'), 'paper_chamber', '--rate', '20', '--duration', '2h');
    system.startChain({ speed: '10', record });
    system.start('navigation_filter', 'navigation_filter', '--heading', '0');
    await system.startConsole();
    await system.publishDiagnosis();
    page = await system.openConsole();
    await until(page, 'verdict-compensating', (t) => /✓\s*Compensating/.test(t), 60_000);
  });
  after(() => system.stopAll());

  /** `examine(what it is)` in each view, and in both dialogs. */
  async function everyView(examine, width) {
    for (const [i, tab] of TABS.entries()) {
      await page.keyboard.press(String(i + 1));
      await page.waitForTimeout(300);
      await examine(`${tab} at ${width}`);
    }
    for (const [key, dialog] of [['c', 'command'], ['?', 'help']]) {
      await page.keyboard.press(key);
      await examine(`${dialog} at ${width}`);
      await close(page);
    }
  }

  test('the Allan table is shown whole, with its units', async () => {
    await page.keyboard.press('2');
    for (const size of SIZES) {
      await page.setViewportSize(size);
      for (const axis of 'xyz') {
        const table = page.locator(`[data-testid="allan-${axis}"] table`);
        await table.getByRole('rowheader', { name: /^N \[deg\/sqrt\(h\)\]/ }).waitFor();
        const { reach, room } = await table.evaluate((t) => ({ reach: t.parentElement.scrollWidth, room: t.parentElement.clientWidth }));
        assert.ok(reach <= room, `axis ${axis} at ${size.width}: ${reach} pixels in ${room}`);
        const last = await table.getByRole('columnheader', { name: 'compensated' }).boundingBox();
        assert.ok(last.x + last.width <= size.width, `axis ${axis} at ${size.width}: ends at ${last.x + last.width}`);
      }
    }
    await page.setViewportSize(SIZES[0]);
  });

  test('every tab is in sight, on a phone too', async () => {
    for (const size of SIZES) {
      await page.setViewportSize(size);
      for (const tab of TABS) {
        const { x, width } = await page.locator(`#tab-${tab}`).boundingBox();
        assert.ok(x >= 0 && x + width <= size.width, `${tab} at ${size.width}: ${x} to ${x + width}`);
      }
      const { reach, room } = await page.locator('.tabs').evaluate((t) => ({ reach: t.scrollWidth, room: t.clientWidth }));
      assert.ok(reach <= room, `${reach} pixels in ${room}`);
    }
    await page.setViewportSize(SIZES[0]);
  });

  test('on a phone the tables of health and events are cards that nothing cuts', async () => {
    await page.setViewportSize(SIZES[1]);
    for (const [key, tables] of [['3', ['hops', 'services', 'endpoints']], ['6', ['events']]]) {
      await page.keyboard.press(key);
      for (const id of tables) {
        const { reach, room } = await part(page, id).evaluate((t) => ({ reach: t.parentElement.scrollWidth, room: t.parentElement.clientWidth }));
        assert.ok(reach <= room, `${id}: ${reach} pixels in ${room}`);
      }
    }
    await page.keyboard.press('3');
    await until(page, 'bars-legend', (t) => /Tick: the median.*Box:.*99 of 100.*Line:/.test(t));
    const up = await part(page, 'services').evaluate((t) => getComputedStyle(t.querySelector('td[data-head="Up"]'), '::before').content);
    assert.match(up, /Up/, 'a cell says what it is');
    const says = await part(page, 'services').locator('td[data-head="Says"]').allTextContents();
    assert.ok(says.includes('1 gyro'), says.join());
    await page.setViewportSize(SIZES[0]);
  });

  test('the twin shows its candidates, and what it leaves against an input', async () => {
    await page.keyboard.press('4');
    await page.getByRole('button', { name: 'Axis y' }).click();
    await until(page, 'candidates', (t) => /magnetic\s*\d[\d.]* %/.test(t));
    await until(page, 'twin', (t) => /Residual against \S+/.test(t));
    const canvas = '[data-testid="twin"] [data-x-scale="linear"] canvas';
    await page.locator(canvas).waitFor();
    const drawn = () => pixels(page, canvas, 'a > 200 && r > 140 && g < 120 && b < 60');
    const end = Date.now() + 20_000;
    while ((await drawn()) <= 100) {
      assert.ok(Date.now() < end, 'points of the residual');
      await page.waitForTimeout(50);
    }
  });

  test('the navigation view shows heading, roll and pitch over time', async () => {
    await page.keyboard.press('5');
    for (const angle of ['headingError', 'attitudeError', 'roll', 'pitch']) await part(page, `attitude-${angle}`).waitFor({ timeout: 60_000 });
  });

  for (const theme of ['light', 'dark']) {
    test(`axe finds nothing in any view, ${theme}, wide and on a phone`, async () => {
      await page.evaluate(() => document.activeElement.blur());
      await page.emulateMedia({ colorScheme: theme });
      const examine = async (what) => {
        const violations = await examinePage(page);
        assert.deepEqual(violations.map((v) => `${what}: ${v.impact}: ${v.id}: ${v.nodes[0].html}`), []);
      };
      for (const size of SIZES) {
        await page.setViewportSize(size);
        await everyView(examine, size.width);
      }
      await page.setViewportSize(SIZES[0]);
      await page.keyboard.press('1');
      await page.emulateMedia({ colorScheme: 'light' });
    });
  }

  test('losses are acknowledged by the keyboard, stay listed, and a reload keeps that', async () => {
    const lose = async () => {
      system.signal('gyro_publisher', 'SIGSTOP');
      await until(page, 'unseen', (t) => /^\d+ loss/.test(t));
      system.signal('gyro_publisher', 'SIGCONT');
      await until(page, 'verdict-data', (t) => /Good/.test(t));
    };
    const acknowledge = async () => {
      await page.locator('#tab-events').focus();
      for (let i = 0; i < 6 && (await page.evaluate(() => document.activeElement.dataset.testid)) !== 'acknowledge'; ++i) await page.keyboard.press('Tab');
      // On a busy machine others fall silent for two seconds too.
      const end = Date.now() + 20_000;
      while ((await part(page, 'unseen').count()) > 0) {
        assert.ok(Date.now() < end, 'still counted');
        await page.keyboard.press('Enter');
        await page.waitForTimeout(100);
      }
    };
    const isListed = (t) => /acknowledged, [\d.]+ \w+ old[^]*Fell silent/.test(t);
    const silences = () => page.locator('[data-testid="events"] tr', { hasText: 'gyro_publisher (pid' }).filter({ hasText: 'Fell silent' });
    await lose();
    await page.keyboard.press('6');
    await acknowledge();
    await until(page, 'events', isListed);
    const acknowledged = await silences().count();
    await page.reload();
    await until(page, 'verdict-data', (t) => /Good/.test(t));
    await page.keyboard.press('6');
    await until(page, 'events', isListed);
    assert.ok((await silences().and(page.locator('.seen')).count()) >= acknowledged, 'a reload forgets nothing');
    await acknowledge();
    await lose();
  });

  test('what a monitor and a filter said that died goes with the gateway that knew of it', async () => {
    await page.keyboard.press('2');
    const rows = page.locator('[data-testid="allan-x"] table').getByRole('rowheader', { name: /^N \[/ });
    await rows.waitFor();
    for (const name of ['allan_monitor', 'navigation_filter', 'console']) await system.stop(name, 'SIGKILL');
    await until(page, 'verdict-data', (t) => /Gateway gone/.test(t));
    assert.equal(await rows.count(), 1, 'what came before is kept');
    await system.startConsole();
    await until(page, 'verdict-data', (t) => /Good/.test(t));
    assert.equal(await rows.count(), 0);
    await page.keyboard.press('5');
    await part(page, 'navigation-empty').waitFor();
  });

  test('no script failed and nothing was refused by the content security policy', () => {
    assert.deepEqual(page.problems, []);
  });
});
