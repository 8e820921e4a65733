// SPDX-License-Identifier: Apache-2.0
// TypeScript of idl/proto/telemetry.proto into src/generated. ZERODRIFT_PROTO_DIR: where the .proto is.
import { execFileSync } from 'node:child_process';
import { mkdirSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const root = join(dirname(fileURLToPath(import.meta.url)), '..');
const protos = resolve(process.env.ZERODRIFT_PROTO_DIR ?? join(root, '../../../idl/proto'));
const out = join(root, 'src/generated');

mkdirSync(out, { recursive: true });
execFileSync(
  process.env.PROTOC ?? 'protoc',
  [
    `--plugin=protoc-gen-es=${join(root, 'node_modules/.bin/protoc-gen-es')}`,
    `--es_out=${out}`,
    '--es_opt=target=ts,import_extension=ts',
    `--proto_path=${protos}`,
    'telemetry.proto',
  ],
  { stdio: 'inherit' },
);
