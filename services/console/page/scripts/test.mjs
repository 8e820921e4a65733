// SPDX-License-Identifier: Apache-2.0
// Runs the compiled unit tests; `node --test` takes no folder that is the same in Node 18 and 20.
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';

const folder = 'build/test/tests';
const files = readdirSync(folder).filter((name) => name.endsWith('.test.js')).map((name) => `${folder}/${name}`);
process.exit(spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' }).status ?? 1);
