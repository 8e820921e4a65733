// SPDX-License-Identifier: Apache-2.0
// Generates, bundles, adds the licences of what was bundled, and refuses a page that is too big.
//   ZERODRIFT_PROTO_DIR  where telemetry.proto is    (default: ../../../idl/proto)
//   ZERODRIFT_PAGE_OUT   where the page goes         (default: dist)
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { build } from 'vite';
import { copyrightParagraphs, notingModules } from './licences.mjs';

const LARGEST_BYTES = 200_000; // of all files, gzip

await import('./generate.mjs');
const bundled = new Set();
await build({ logLevel: 'warn', plugins: [notingModules(bundled)], worker: { plugins: () => [notingModules(bundled)] } });

function filesBelow(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) =>
    entry.isDirectory() ? filesBelow(join(folder, entry.name)) : [join(folder, entry.name)],
  );
}

const out = process.env.ZERODRIFT_PAGE_OUT ?? 'dist';
writeFileSync(join(out, 'licences.txt'), copyrightParagraphs(bundled, 'usr/share/zerodrift/console/*'));
let total = 0;
for (const file of filesBelow(out)) {
  const size = gzipSync(readFileSync(file), { level: 9 }).length;
  total += size;
  console.log(`${String(size).padStart(8)}  ${file}`);
}
console.log(`${String(total).padStart(8)}  gzip in all, at most ${LARGEST_BYTES}`);
if (total > LARGEST_BYTES) {
  console.error(`page: found ${total} bytes gzip, expected at most ${LARGEST_BYTES}`);
  process.exit(1);
}
