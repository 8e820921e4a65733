// SPDX-License-Identifier: Apache-2.0
// Judges a Dockerfile: what dockerfile-utils finds, and the project's own rules. One line a finding; exit code 1 if any.
import { readFileSync } from 'node:fs';
import utils from 'dockerfile-utils';

const [path] = process.argv.slice(2);
const text = readFileSync(path, 'utf8');
const findings = utils.validate(text, {}).map((found) => `${found.range.start.line + 1}: ${found.message}`);

const rules = [
  [/^\s*FROM\s+\S+:latest\b/im, 'an image must not be named latest'],
  [/^\s*FROM\s+[^\s:@]+(\s|$)(?!.*#)/im, 'an image needs a tag'],
  [/^#\s*syntax=/im, 'no syntax line: it would be fetched'],
  [/^\s*(RUN|COPY)\s+.*<</im, 'no here-document: older builders don\'t know it'],
  [/^\s*COPY\s+.*--link\b/im, 'no COPY --link: older builders don\'t know it'],
  [/^\s*ADD\s/im, 'COPY, not ADD'],
  [/https?:\/\//i, 'no address of a registry or mirror'],
];
for (const [pattern, message] of rules) {
  const found = pattern.exec(text);
  if (found) findings.push(`${text.slice(0, found.index).split('\n').length}: ${message}`);
}
if (!/^\s*USER\s+\d+:\d+/im.test(text)) findings.push('no USER by numbers');
if (!/^\s*HEALTHCHECK\s/im.test(text)) findings.push('no HEALTHCHECK');
for (const found of findings) console.log(`${path}:${found}`);
if (findings.length > 0) process.exit(1);
console.log('0 findings');
