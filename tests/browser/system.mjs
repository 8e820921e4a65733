// SPDX-License-Identifier: Apache-2.0
// Starts the real processes in a DDS domain of their own, and ends what it started.
//   ZERODRIFT_BIN     folder of the programs       (default: ../../build/release/bin)
//   ZERODRIFT_CONFIG  models and profiles          (default: ../../config)
//   ZERODRIFT_DOMAIN  DDS domain                   (default: 230)
//   ZERODRIFT_PORT    of the console               (default: 8799)
//   ZERODRIFT_PAGE    folder of the built page     (default: what the console finds beside itself)
import { spawn, execFile } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises'; // the global one stays for deadlines
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';
import { launch, openPage } from './browser.mjs';

const root = join(dirname(fileURLToPath(import.meta.url)), '../..');
export const config = process.env.ZERODRIFT_CONFIG ?? join(root, 'config');
const bin = process.env.ZERODRIFT_BIN ?? join(root, 'build/release/bin');
const domain = process.env.ZERODRIFT_DOMAIN ?? '230';
export const port = Number(process.env.ZERODRIFT_PORT ?? 8799);
export const address = `http://127.0.0.1:${port}/`;
const STOP_WITHIN_MS = 5000;
const run = (...args) => promisify(execFile)(join(bin, 'zerodrift'), args);

export class System {
  #running = new Map();
  #own = new Map(); // profiles that a test made: their files by name
  #browser; // one for all pages, from the first on
  folder = mkdtempSync(join(tmpdir(), 'zerodrift-console-'));

  start(name, program, ...args) {
    if (this.#running.has(name)) throw new Error(`${name} runs already`); // it would be ended by nobody
    // It ends with this process however that ends: what goes on would answer the next run's pages.
    const command = ['--pdeathsig', 'KILL', join(bin, program), ...args, '--domain', domain];
    const child = spawn('setpriv', command, { stdio: ['ignore', 'ignore', 'pipe'] });
    const log = [];
    child.stderr.on('data', (text) => log.push(String(text)));
    this.#running.set(name, { child, log, ended: new Promise((done) => child.on('exit', done)) });
  }

  /** Publishers, compensation and monitor. `record`: a file in place of a simulation; `publisher`: more options of gyro_publisher. */
  startChain({ waitFor = 'compensation,allan_monitor', ...gyro } = {}) {
    this.start('allan_monitor', 'allan_monitor');
    this.startCompensation();
    this.startGyro({ waitFor, ...gyro });
  }

  /** With `instance` one of several that answer the same, which is named compensation/1. */
  startCompensation({ instance = 0, remembers = true, options = [] } = {}) {
    const one = instance > 0 ? ['--instance', String(instance), '--redundant'] : [];
    const folder = remembers ? ['--checkpoint-dir', this.folder] : [];
    this.start(instance > 0 ? `compensation/${instance}` : 'compensation', 'compensation', ...one, ...folder, ...options);
  }

  /** Publishers of a gyro, `parts` of the two; those of gyro 7 are named gyro_publisher:7. `both`: more options of each. */
  startGyro({ id = 1, speed = '1', record = '', model = 'paper_fog', profile = 'paper_chamber', publisher = [], both = [], waitFor = 'compensation', parts = ['thermal_publisher', 'gyro_publisher'] } = {}) {
    const simulation = ['--source', 'simulation', '--model', join(config, `models/${model}.yaml`), '--profile', this.#profile(profile), '--seed', '1'];
    const source = [...(record ? ['--source', 'record', '--record', record] : simulation), '--speed', speed, '--gyro-id', String(id), ...both];
    const more = { thermal_publisher: [], gyro_publisher: ['--wait-for', waitFor, ...publisher] };
    for (const part of parts) this.start(id === 1 ? part : `${part}:${id}`, part, ...source, ...more[part]);
  }

  startRecorder() {
    this.start('recorder', 'zerodrift', 'record', '--out', join(this.folder, 'everything.mcap'));
  }

  async startConsole(...options) {
    if (await fetch(address).then(() => true, () => false)) throw new Error(`something else answers at ${address} already`);
    const page = process.env.ZERODRIFT_PAGE ? ['--page', process.env.ZERODRIFT_PAGE] : [];
    this.start('console', 'console', '--listen', `127.0.0.1:${port}`, ...page, ...options);
    for (let attempt = 0; attempt < 100; ++attempt) {
      if (await fetch(address).then((r) => r.ok, () => false)) return;
      await sleep(100);
    }
    throw new Error(`the console does not answer at ${address}: ${this.log('console')}`);
  }

  log(name) {
    return this.#running.get(name)?.log.join('') ?? '';
  }

  pid(name) {
    return this.#running.get(name)?.child.pid;
  }

  signal(name, signal) {
    this.#running.get(name)?.child.kill(signal);
  }

  async stop(name, signal = 'SIGTERM') {
    const process = this.#running.get(name);
    if (!process) return;
    this.#running.delete(name);
    process.child.kill('SIGCONT');
    process.child.kill(signal);
    const late = setTimeout(() => process.child.kill('SIGKILL'), STOP_WITHIN_MS);
    await process.ended;
    clearTimeout(late);
  }

  async openPage(options) {
    this.#browser ??= await launch();
    return openPage(this.#browser, options);
  }

  async openConsole() {
    const page = await this.openPage();
    await page.goto(address);
    return page;
  }

  async stopAll() {
    await this.#browser?.close();
    await Promise.all([...this.#running.keys()].map((name) => this.stop(name)));
    rmSync(this.folder, { recursive: true, force: true });
  }

  #profile(name) {
    return this.#own.get(name) ?? join(config, `profiles/${name}.yaml`);
  }

  /** A profile in which nothing but `turns` happens: [start_s, duration_s, axis, rate_deg_s] each. */
  makeProfile(name, turns) {
    const file = join(this.folder, `${name}.yaml`);
    const lines = turns.map(([start, duration, axis, rate]) => `  - {start_s: ${start}, duration_s: ${duration}, axis: ${axis}, rate_deg_s: ${rate}, ramp_s: 1}`);
    writeFileSync(file, [`name: ${name}`, 'duration_s: 18000', 'initial_temperature_degc: 20', 'power_on_s: 0', 'turns:', ...lines, ''].join('\n'));
    this.#own.set(name, file);
  }

  /** A record of a profile, true rates included; its file. */
  async simulate(model, profile, ...options) {
    const record = join(this.folder, `${profile}.csv`);
    await run('simulate', '--model', model, '--profile', this.#profile(profile), '--reference', '--out', record, ...options);
    return record;
  }

  /**
   * A record, five samples a second: drift in deg/h after time in s and temperature in degC, the same on each axis, and white
   * noise; its true rate of 0 is told until `knownUntilS`. Its file.
   */
  makeRecord(name, durationS, drift, knownUntilS) {
    const file = join(this.folder, `${name}.csv`);
    let state = 1;
    const uniform = () => (state = (state * 48271) % 2147483647) / 2147483647; // Park and Miller's generator
    const radS = (degH) => ((degH + 0.4 * Math.sqrt(3) * (uniform() - 0.5)) * Math.PI) / 180 / 3600; // noise of 0.2 deg/h
    const rows = Array.from({ length: 5 * durationS }, (_, i) => {
      const degC = 22 + 6 * Math.sin((2 * Math.PI * i) / 5 / 900);
      const rates = Array.from({ length: 3 }, () => radS(drift(i / 5, degC)).toPrecision(9));
      const known = Array(3).fill(i / 5 < knownUntilS ? '0' : '');
      return [(i / 5).toFixed(1), ...rates, degC.toFixed(4), ...known].join(',');
    });
    const axes = (quantity) => ['x', 'y', 'z'].map((axis) => `${quantity}_${axis}_rad_s`);
    const header = ['time_s', ...axes('rate'), 'temperature_coil_degC', ...axes('reference')].join(',');
    writeFileSync(file, [header, ...rows, ''].join('\n'));
    return file;
  }

  /** A gyro that feels the magnetic field along y, which its model doesn't know, is diagnosed and the finding published. */
  async publishDiagnosis() {
    const known = join(config, 'models/lab_fog.yaml');
    const gyro = join(this.folder, 'gyro.yaml');
    const effect = '  - {kind: magnetic, axis: y, parameters: {x_deg_h_per_ut: 0, y_deg_h_per_ut: 0.002, z_deg_h_per_ut: 0}}';
    writeFileSync(gyro, `${readFileSync(known, 'utf8').trimEnd()}\n${effect}\n`);
    const record = await this.simulate(gyro, 'diagnosis_chamber', '--rate', '1');
    await run('diagnose', '--model', known, '--record', record, '--publish', '--domain', domain);
  }

  /** What `zerodrift ctl ...` prints. */
  async ctl(...args) {
    const { stdout } = await run('ctl', ...args, '--domain', domain);
    return stdout;
  }
}
