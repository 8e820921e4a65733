// SPDX-License-Identifier: Apache-2.0
// A link to the console that is slower than what it sends.
import { createServer, connect } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';

const SLICE_BYTES = 256;

export class SlowLink {
  bytesPerS = Infinity;
  #sockets = new Set();

  /** Where a page finds the console on `port` behind it. */
  async open(port) {
    this.server = createServer((page) => {
      const console = connect(port, '127.0.0.1');
      for (const socket of [page, console]) {
        this.#sockets.add(socket);
        socket.on('error', () => {});
        socket.on('close', () => [page, console].forEach((s) => s.destroy()));
      }
      page.pipe(console);
      this.#forward(console, page).catch(() => {}); // one of both was closed
    });
    await new Promise((ready) => this.server.listen(0, '127.0.0.1', ready));
    return `http://127.0.0.1:${this.server.address().port}/`;
  }

  close() {
    for (const socket of this.#sockets) socket.destroy();
    this.server.close();
  }

  async #forward(from, to) {
    for await (const chunk of from) {
      for (let at = 0; at < chunk.length; at += SLICE_BYTES) {
        const slice = chunk.subarray(at, at + SLICE_BYTES);
        if (Number.isFinite(this.bytesPerS)) await sleep((1000 * slice.length) / this.bytesPerS);
        if (!to.write(slice) && !to.destroyed) await new Promise((drained) => to.once('drain', drained).once('close', drained));
      }
    }
  }
}
