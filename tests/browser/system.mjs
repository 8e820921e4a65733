// SPDX-License-Identifier: Apache-2.0
// Starts the real processes in a DDS domain of their own, and ends what it started.
//   ZERODRIFT_BIN     folder of the programs       (default: ../../build/release/bin)
//   ZERODRIFT_CONFIG  models and profiles          (default: ../../config)
//   ZERODRIFT_DOMAIN  DDS domain                   (default: 230)
//   ZERODRIFT_PORT    of the console               (default: 8799)
//   ZERODRIFT_PAGE    folder of the built page     (default: what the console finds beside itself)
import { spawn, execFile } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises'; // the global one stays for deadlines
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';

const root = join(dirname(fileURLToPath(import.meta.url)), '../..');
const config = process.env.ZERODRIFT_CONFIG ?? join(root, 'config');
const bin = process.env.ZERODRIFT_BIN ?? join(root, 'build/release/bin');
const domain = process.env.ZERODRIFT_DOMAIN ?? '230';
export const port = Number(process.env.ZERODRIFT_PORT ?? 8799);
export const address = `http://127.0.0.1:${port}/`;
const STOP_WITHIN_MS = 5000;

export class System {
  #running = new Map();
  folder = mkdtempSync(join(tmpdir(), 'zerodrift-console-'));

  start(name, program, ...args) {
    const child = spawn(join(bin, program), ['--domain', domain, ...args], { stdio: ['ignore', 'ignore', 'pipe'] });
    const log = [];
    child.stderr.on('data', (text) => log.push(String(text)));
    this.#running.set(name, { child, log, ended: new Promise((done) => child.on('exit', done)) });
  }

  /** Publishers, compensation and monitor. `publisher`: more options of gyro_publisher. */
  startChain({ speed = '1', model = 'paper_fog', profile = 'paper_chamber', publisher = [], waitFor = 'compensation,allan_monitor' } = {}) {
    const source = ['--source', 'simulation', '--model', join(config, `models/${model}.yaml`), '--profile', join(config, `profiles/${profile}.yaml`), '--seed', '1', '--speed', speed];
    this.start('allan_monitor', 'allan_monitor');
    this.start('compensation', 'compensation', '--checkpoint-dir', this.folder);
    this.start('thermal_publisher', 'thermal_publisher', ...source);
    this.start('gyro_publisher', 'gyro_publisher', ...source, '--wait-for', waitFor, ...publisher);
  }

  async startConsole(...options) {
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

  async stopAll() {
    await Promise.all([...this.#running.keys()].map((name) => this.stop(name)));
    rmSync(this.folder, { recursive: true, force: true });
  }

  /** What `zerodrift ctl ...` prints. */
  async ctl(...args) {
    const { stdout } = await promisify(execFile)(join(bin, 'zerodrift'), ['ctl', ...args, '--domain', domain]);
    return stdout;
  }
}
