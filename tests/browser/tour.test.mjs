// SPDX-License-Identifier: Apache-2.0
// What happens in a real system, and the words that the page has for it. A situation bears its name in
// page/tests/tour.test.ts, which has the words for more of them, on facts that are made up.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { hostname } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { violations } from './axe.mjs';
import { close, part, said, until } from './browser.mjs';
import { SlowLink } from './slow_link.mjs';
import { System, address, config, port } from './system.mjs';

const START_MS = 60_000;
const LEASES_MS = 60_000; // until the middleware gives a dead process up
const HOUR_MS = 3_600_000;
const TOLD = readFileSync(join(config, '../services/console/page/tests/tour.test.ts'), 'utf8');

function situation(name, walk) {
  test(name, async () => {
    assert.ok(TOLD.includes(`situation: '${name}'`) || TOLD.includes(`situation: "${name}"`), 'the tour has no situation of this name');
    await walk();
  });
}

const NOTHING = { compensating: '· –: no data yet', better: '· –: no data yet', learning: '· –: no data yet' };
const COMPENSATES = '✓ Compensating: all three axes';
const LEARNS = '✓ Learning: at rest, or against a reference';
const COMPENSATES_AND_LEARNS = { compensating: COMPENSATES, learning: LEARNS };
const LAST_KNOWN = {
  compensating: '· Not known now: last known: Compensating, all three axes',
  learning: '· Not known now: last known: Learning, at rest, or against a reference',
};
const NOTHING_LEARNED = {
  compensating: '● Not compensating yet: nothing has been learned yet',
  better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
  learning: '● Not learning: nothing has been learned yet',
};
const GOOD = '✓ Good: live, none missing';
const GOOD_REPLAY = '✓ Good (replay {pace}×): none missing';
const WAITS = 'compensation reports "rates wait for temperatures; is thermal_publisher running?"';

/** What is said of data and in the banner when no sample comes for the reason `what`, "x is gone" or "x has ended". */
function silent(what) {
  const when = what.endsWith('ended') ? '{age} ago' : 'since {age}';
  return {
    data: `✕ Stale: {age} old: ${what} ${when}; shown is the last that did`,
    banner: `${what}: no sample comes any more; everything shown is old. (${when}; newest sample {age} ago)`,
  };
}
const SILENT = {
  data: '✕ Stale: {age} old: no sample comes; shown is the last that did',
  banner: 'No sample comes any more; everything shown is old. (newest sample {age} ago)',
};

/** A command by the page's own dialog, and its answer. */
async function command(page, title, answer, fill = async () => {}) {
  await page.keyboard.press('c');
  await page.getByLabel(title, { exact: true }).check();
  await fill();
  await part(page, 'send').click();
  await until(page, 'reply', (t) => answer.test(t));
  await close(page);
}

/** All that is said of the data while `walk` goes on. */
async function saidMeanwhile(page, walk) {
  await part(page, 'verdict-data').evaluate((tile) => {
    window.answers = [];
    new MutationObserver(() => window.answers.push(tile.querySelector('.answer').textContent)).observe(tile, { subtree: true, childList: true, characterData: true });
  });
  await walk();
  return page.evaluate(() => window.answers);
}

/** A page on a computer whose clock is an hour behind: the page's own and its worker's, which looks at it again each time. */
async function openPageOfAnHourAgo(system) {
  const behind = (ms) => {
    const [now, origin] = [Date.now.bind(Date), performance.timeOrigin];
    Date.now = () => now() - ms;
    Object.defineProperty(performance, 'timeOrigin', { value: origin - ms });
  };
  const page = await system.openPage();
  await page.addInitScript(behind, HOUR_MS);
  const [worker] = await Promise.all([page.waitForEvent('worker'), page.goto(address)]);
  await worker.evaluate(behind, HOUR_MS);
  return page;
}

function systemWithPage(prepare) {
  const system = new System();
  const at = { system, page: undefined };
  before(async () => {
    await system.startConsole();
    at.page = await system.openConsole();
    await prepare?.(at);
  });
  after(() => system.stopAll());
  return at;
}

function named(system, name) {
  return `${name.split(':')[0]} (host ${hostname()}, pid ${system.pid(name)})`;
}

describe('a chain from its start on, of which one after the other fails', () => {
  const at = systemWithPage();
  const { system } = at;
  const rate = ['--rate', '20']; // 1200 samples a second at 60 times real time

  situation('start: nothing runs yet', () => said(at.page, { ...NOTHING, data: '✕ No gyro: the gateway receives no compensated_rate in its domain' }));

  situation('gateway gone before it told anything', async () => {
    await system.stop('console', 'SIGKILL');
    await said(at.page, { ...NOTHING, data: '✕ Gateway gone: tries again by itself', banner: 'The gateway is gone. What came before is kept.' });
    await system.startConsole();
    await said(at.page, { ...NOTHING, data: '✕ No gyro: the gateway receives no compensated_rate in its domain' });
  });

  situation('start: services run, no sample came', async () => {
    system.startGyro({ parts: ['gyro_publisher'], publisher: rate });
    await said(at.page, { ...NOTHING, data: '✕ No sample yet: services tell of this gyro; no compensated_rate of it came' });
  });

  situation('no thermometer at the start of a replay', async () => {
    system.startCompensation();
    await said(at.page, { ...NOTHING, data: `✕ No sample yet: ${WAITS}`, banner: `${WAITS}: no sample comes.` }, START_MS);
    await until(at.page, 'no-gyro', (t) => t.includes(WAITS));
  });

  situation('start: first samples', async () => {
    system.startGyro({ parts: ['thermal_publisher'] });
    await said(at.page, { ...NOTHING_LEARNED, data: GOOD }, START_MS);
  });

  situation('first minute: a mean is held', async () => {
    await system.ctl('replay', 'speed 3');
    await said(at.page, {
      compensating: '✓ Compensating: x, y, z by the last stationary mean',
      better: '· Not comparable yet: the first mean is held; comparing begins with the first model',
      learning: '● Not learning: the first set of labels is not complete yet',
      data: GOOD_REPLAY,
    }, START_MS);
  });

  situation('first minutes: a model, and few minutes of it', () =>
    said(at.page, {
      ...COMPENSATES_AND_LEARNS,
      better: '· Not comparable yet: needs three minutes at rest, or of a known true rate, with a model',
      data: GOOD_REPLAY,
    }, START_MS));

  situation('replay at 60 times real time', async () => {
    await system.ctl('replay', 'speed 60');
    await until(at.page, 'verdict-data', (t) => /Good \(replay [56]\d×\)/.test(t)); // a busy machine keeps up with not quite 60
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: GOOD_REPLAY });
  });

  situation('healthy', () => said(at.page, { ...COMPENSATES_AND_LEARNS, better: '✓ {ratio}: steadier than raw; means of 60 s over {age}, at rest' }, START_MS));

  situation('passthrough by command', async () => {
    await command(at.page, 'Freeze', /Done.*frozen/);
    await said(at.page, { compensating: COMPENSATES, learning: '● Frozen: somebody commanded it' });
    await command(at.page, 'Reset', /Done.*forgotten/);
    await said(at.page, {
      compensating: '● Not compensating: somebody commanded it',
      better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
      learning: '● Frozen: somebody commanded it',
      data: GOOD_REPLAY,
    });
    await command(at.page, 'Learn', /Done/);
    await said(at.page, COMPENSATES_AND_LEARNS);
  });

  situation('refused command', async () => {
    await command(at.page, 'Restore', /Refused compensation: .*nobody_saved_this/, () => part(at.page, 'checkpoint-name').fill('nobody_saved_this'));
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: GOOD_REPLAY });
  });

  situation('lost samples in a replay', async () => {
    await system.ctl('inject', 'gap:xyz:0:1');
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: '▲ With losses (replay {pace}×): {count} samples missing, the last {age} ago' });
  });

  situation('lost samples', async () => {
    await system.ctl('replay', 'speed 1');
    await system.ctl('inject', 'gap:xyz:0:0.1');
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: '▲ With losses: {count} samples missing, the last {age} ago' });
  });

  situation('late console join: losses of before', async () => {
    const late = await at.system.openConsole();
    await said(late, { ...COMPENSATES_AND_LEARNS, data: '✓ Good: live, {count} samples missing, none in the {age} since this page listens' });
    assert.deepEqual(late.problems, []);
    await late.context().close();
  });

  situation('recorder ended orderly', async () => {
    system.startRecorder();
    await at.page.keyboard.press('3');
    await until(at.page, 'services', (t) => /recorder[^]*running/.test(t));
    await system.stop('recorder');
    await until(at.page, 'services', (t) => /recorder[^]*ended/.test(t));
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: '▲ With losses: {count} samples missing, the last {age} ago' });
    await at.page.keyboard.press('1');
  });

  situation('gateway gone', async () => {
    await system.stop('console', 'SIGKILL');
    await said(at.page, { ...LAST_KNOWN, data: '✕ Gateway gone: shown is what came until {age} ago', banner: 'The gateway is gone. What came before is kept.' });
    await system.startConsole();
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: GOOD });
  });

  situation('stale data, and nobody is known to be gone', async () => {
    await system.ctl('replay', 'pause');
    await said(at.page, { ...LAST_KNOWN, ...SILENT });
    await system.ctl('replay', 'resume');
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: GOOD });
  });

  test('a publisher that hangs is named, and no more once it goes on', async () => {
    system.signal('gyro_publisher', 'SIGSTOP');
    await said(at.page, { ...LAST_KNOWN, ...silent(`${named(system, 'gyro_publisher')} is gone`) });
    const answers = await saidMeanwhile(at.page, async () => {
      system.signal('gyro_publisher', 'SIGCONT');
      await said(at.page, { ...COMPENSATES_AND_LEARNS, data: GOOD });
    });
    assert.deepEqual(answers.filter((t) => t.includes('replay')), [], 'a silence is no slow replay');
  });

  situation('a link that is slower than the samples', async () => {
    const link = new SlowLink();
    const far = await at.system.openPage();
    try {
      await far.goto(await link.open(port));
      await said(far, { ...COMPENSATES_AND_LEARNS, data: GOOD });
      link.bytesPerS = 2000;
      await said(far, {
        ...LAST_KNOWN,
        data: '▲ Late: {age} behind: samples wait for the link or this browser; shown is what was then',
        banner: 'What is shown is old: it waits for the link or this browser. ({age} behind)',
      }, START_MS);
      link.bytesPerS = Infinity;
      await said(far, { ...COMPENSATES_AND_LEARNS, data: GOOD }, START_MS);
      assert.deepEqual(far.problems, []);
    } finally {
      await far.context().close();
      link.close();
    }
  });

  situation("clock step: the system's clock is an hour ahead of the browser's", async () => {
    const behind = await openPageOfAnHourAgo(at.system);
    await said(behind, { ...COMPENSATES_AND_LEARNS, data: GOOD });
    assert.ok(Math.abs((await behind.evaluate(() => Date.now())) - Date.now() + HOUR_MS) < 60_000);
    const dead = `${named(system, 'compensation')} is gone`;
    const killedMs = Date.now();
    await system.stop('compensation', 'SIGKILL');
    const { banner } = await said(behind, { ...LAST_KNOWN, ...silent(dead) });
    const [, sinceS] = /since ([\d.]+)(?= s)/.exec(banner) ?? [];
    assert.ok(Number(sinceS ?? 0) <= (Date.now() - killedMs) / 1000 + 1, banner);
    assert.deepEqual(behind.problems, []);
    await behind.context().close();
    await said(at.page, { ...LAST_KNOWN, ...silent(dead) });
  });

  situation('service restarted: it learns anew', async () => {
    system.startCompensation({ remembers: false });
    await said(at.page, NOTHING_LEARNED, LEASES_MS);
    const pid = system.pid('compensation');
    await at.page.keyboard.press('3');
    await until(at.page, 'services', (t) => new RegExp(`compensation[^]*, ${pid}`).test(t));
    await at.page.keyboard.press('1');
    await system.ctl('replay', 'speed 10');
    await said(at.page, COMPENSATES_AND_LEARNS, START_MS);
  });

  situation('dead service: thermal_publisher of a replay', async () => {
    const dead = `${named(system, 'thermal_publisher')} is gone`;
    await system.stop('thermal_publisher', 'SIGKILL');
    await said(at.page, silent(dead), START_MS);
  });

  situation('a dead thermal_publisher that nothing waits for', () =>
    // Once the middleware has given it up, rates are answered without.
    said(at.page, {
      compensating: '✓ Compensating: x, y, z by a simpler estimate than the model',
      learning: '● Not learning: no recent temperature',
    }, LEASES_MS));

  situation('dead service: the publisher was stopped', async () => {
    const ended = `${named(system, 'gyro_publisher')} has ended`;
    await system.stop('gyro_publisher');
    await said(at.page, silent(ended));
  });

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('a gyro that moves, and one whose source has an end', () => {
  const at = systemWithPage(({ system }) => {
    system.makeProfile('moves_later', Array.from({ length: 60 }, (_, i) => [120 + 20 * i, 20, 'z', i % 2 === 0 ? 3 : -3]));
    system.startCompensation({ remembers: false });
    system.startGyro({ id: 1, speed: '20', profile: 'moves_later', publisher: ['--rate', '20'] });
    system.startGyro({ id: 2, speed: '20', both: ['--duration', '100'], publisher: ['--rate', '20'] });
  });
  const MOVES = 'it moves; true rotation is never learned';

  situation('motion', async () => {
    await part(at.page, 'fleet-1').click({ timeout: START_MS }); // the page chose whichever came first
    await said(at.page, { compensating: COMPENSATES, learning: `● Frozen: ${MOVES}`, data: GOOD_REPLAY }, START_MS);
  });

  situation('a record was published to its end', async () => {
    await part(at.page, 'fleet-2').click();
    await said(at.page, { ...COMPENSATES_AND_LEARNS, data: '● Source has ended: newest sample {age} ago' }, START_MS);
    await part(at.page, 'fleet-1').click();
  });

  situation('motion from the start', async () => {
    await at.system.ctl('reset'); // of what was learned at rest nothing is left
    await said(at.page, {
      compensating: `● Not compensating yet: ${MOVES}`,
      better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
      learning: `● Not learning: ${MOVES}`,
      data: GOOD_REPLAY,
    });
  });

  situation('a record was published to its end, the compensation died, and the page was opened after it', async () => {
    const dead = `${named(at.system, 'compensation')} is gone`;
    await at.system.stop('compensation', 'SIGKILL');
    await at.page.reload();
    await part(at.page, 'fleet-2').click({ timeout: START_MS });
    await until(at.page, 'verdict-data', (t) => /●\s*Source has ended/.test(t) && t.includes(dead));
    await until(at.page, 'verdict-compensating', (t) => /·\s*Not known now/.test(t));
    await until(at.page, 'coverage-now', (t) => /^Last known: /.test(t));
    assert.equal(await part(at.page, 'coverage').locator('td.here').count(), 0);
    assert.equal(await part(at.page, 'strip-rate-axis x').count(), 1, 'the history is drawn');
  });

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('two instances of the compensation', () => {
  const at = systemWithPage(({ system }) => {
    // A replay waits for who died, until the middleware gives it up; a sensor doesn't. Its drift is learned where the Earth's rate counts as drift.
    const file = join(system.folder, 'earth.yaml');
    writeFileSync(file, 'earth_rate: {mode: included}\n');
    for (const instance of [1, 2]) system.startCompensation({ instance, remembers: false, options: ['--config', file] });
    system.startGyro({ speed: '10', parts: ['gyro_publisher'], publisher: ['--rate', '20', '--free-running'] });
  });
  const { system } = at;
  const compensating = 'Compensating: x, y, z by a simpler estimate than the model';
  const answers = { compensating: `✓ ${compensating}`, data: GOOD_REPLAY };

  situation('standby takeover', async () => {
    await said(at.page, answers, START_MS);
    await system.stop('compensation/1', 'SIGKILL');
    await at.page.keyboard.press('3');
    await until(at.page, 'services', (t) => /compensation\/1[^]*gone[^]*compensation\/2/.test(t));
    await said(at.page, answers);
  });

  situation('standby takeover: the second one died too', async () => {
    const dead = `${named(system, 'compensation/2')} is gone`;
    await system.stop('compensation/2', 'SIGKILL');
    await said(at.page, { compensating: `· Not known now: last known: ${compensating.replace(':', ',')}`, ...silent(dead) });
  });

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('a sensor without a thermometer, whose model needs one', () => {
  const at = systemWithPage(({ system }) => {
    system.startCompensation({ options: ['--config', join(config, 'paper.yaml')] });
    system.startGyro({ parts: ['gyro_publisher'], publisher: ['--rate', '20', '--free-running'] });
  });

  situation('passthrough for a fault', () =>
    said(at.page, {
      compensating: '✕ Not compensating: a temperature that the model needs is missing',
      better: '· Not comparable yet: nothing is taken off yet; comparing begins with the first model',
      learning: '● Not learning: a temperature that the model needs is missing',
      data: GOOD,
    }, START_MS));

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('a gyro that is mounted the other way round', () => {
  const at = systemWithPage(async ({ system }) => {
    system.makeProfile('turns_about_y', Array.from({ length: 20 }, (_, i) => [80 + 20 * i, 10, 'y', 2]));
    const record = await system.simulate(join(config, 'models/paper_fog.yaml'), 'turns_about_y', '--rate', '20', '--duration', '400');
    const file = join(system.folder, 'mounting.yaml');
    writeFileSync(file, 'mounting: {axes: [x, -y, z]}\n');
    system.startCompensation({ options: ['--config', file] });
    system.startGyro({ record, speed: '10' });
  });

  situation('wrong sign', () =>
    said(at.page, {
      compensating: COMPENSATES,
      learning: '● Learning on x, z: not on y: it turns the other way round than its reference or the Earth says',
      data: '✕ Wrong sign: y: it turns the other way round than its reference or the Earth says; mounting.axes turns an axis round',
    }, START_MS));

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('gyros whose drift follows the temperature no more', () => {
  const at = systemWithPage(({ system }) => {
    const slope = (degC) => 0.8 * (degC - 22);
    const ceases = system.makeRecord('ceases', 12_000, (s, degC) => 5 + (s < 1200 ? slope(degC) : 0), Infinity);
    // Nobody learns of the second half: the true rate is unknown, and what of the Earth's each axis sees.
    const turnsRound = system.makeRecord('turns_round', 12_000, (s, degC) => (s < 1800 ? 1 : -1) * slope(degC), 1800);
    const file = join(system.folder, 'svr.yaml');
    writeFileSync(file, 'scheme: online-svr\nearth_rate: {mode: unknown}\n'); // the stack's other experts follow what ceases
    system.startCompensation({ remembers: false, options: ['--config', file] });
    system.startGyro({ id: 1, record: ceases, speed: '120' });
    system.startGyro({ id: 2, record: turnsRound, speed: '120' });
  });

  situation('harm by the spread', async () => {
    await part(at.page, 'fleet-2').click({ timeout: START_MS });
    await said(at.page, {
      compensating: COMPENSATES,
      better: '✕ {ratio}: worse than raw on x, y, z; means of 60 s over {age}, at rest',
      learning: '● Frozen: Earth rate is unknown here and must not be learned as drift',
      data: GOOD_REPLAY,
    }, START_MS);
  });

  situation('hold', async () => {
    await part(at.page, 'fleet-1').click();
    await said(at.page, {
      compensating: '✓ Compensating: x, y, z by the last stationary mean',
      better: '✓ {ratio}: steadier than raw; means of 60 s over {age}, against the reference',
      learning: '● Not learning: the last stationary mean predicts better than the model just now',
      data: GOOD_REPLAY,
    }, START_MS);
  });

  test('no script failed', () => assert.deepEqual(at.page.problems, []));
});

describe('ten gyros', () => {
  const system = new System();
  const ids = Array.from({ length: 10 }, (_, i) => i + 1);
  let page;
  before(async () => {
    await system.startConsole();
    page = await system.openConsole();
    system.startCompensation();
    for (const id of ids) system.startGyro({ id, publisher: ['--rate', '20'] });
  });
  after(() => system.stopAll());

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
    assert.equal(await part(page, 'fleet').locator('button').first().getAttribute('data-testid'), 'fleet-7');
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
