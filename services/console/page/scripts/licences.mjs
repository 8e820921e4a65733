// SPDX-License-Identifier: Apache-2.0
// What the bundle holds of others, as it was bundled, and their licences as paragraphs of Debian's machine-readable copyright
// files (https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/).
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

const PACKAGE = /^(.*[/\\]node_modules[/\\](?:@[^/\\]+[/\\])?[^/\\]+)[/\\]/;
const APACHE = 'Licensed under the Apache License, Version 2.0: /usr/share/common-licenses/Apache-2.0 on Debian systems.';

/** A plugin, for the page and its worker, that adds each module of others that went into a chunk. */
export function notingModules(modules) {
  return {
    name: 'zerodrift-noting-modules',
    generateBundle(_, bundle) {
      for (const id of Object.values(bundle).flatMap((chunk) => Object.keys(chunk.modules ?? {}))) {
        if (PACKAGE.test(id)) modules.add(id.replace(/\?.*$/, ''));
        else if (id.startsWith('\0vite/')) modules.add(join(process.cwd(), 'node_modules/vite/package.json'));
      }
    },
  };
}

/** The licence that a package brings along, else those that its bundled modules begin with. */
function licenceText(folder, modules) {
  const file = readdirSync(folder).find((entry) => /^licen[cs]e(\.|$)/i.test(entry));
  if (file) return readFileSync(join(folder, file), 'utf8').trim();
  const heads = modules
    .map((id) => /^(?:\/\/.*\n)+/.exec(readFileSync(id, 'utf8'))?.[0].replace(/^\/\/ ?/gm, '').trim() ?? '')
    .filter((head) => /^Copyright /m.test(head));
  return [...new Set(heads)].join('\n\n---\n\n');
}

function describe(folder, modules) {
  const { name, version, license: written } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const license = written?.replace(/[()]/g, '');
  const text = licenceText(folder, modules);
  if (!license || text === '') throw new Error(`${name} says no licence: ${folder}`);
  const holders = text.match(/^ *Copyright (\(c\)|©|\d).*$/gim) ?? [`the authors of ${name}`];
  return {
    name, version, license,
    text: /Apache License/.test(text) ? `${text}\n\n${APACHE}` : text,
    holders: [...new Set(holders.map((line) => line.trim().replace(/^Copyright (\(c\) *|© *)?/i, '')))],
  };
}

const indented = (text) => text.split(/\r?\n/).map((line) => (line.trim() === '' ? ' .' : ` ${line}`)).join('\n');

/** `files` as they are installed. */
export function copyrightParagraphs(modules, files) {
  const ids = [...modules].sort();
  const folders = [...new Set(ids.map((id) => PACKAGE.exec(id)[1]))];
  const packages = folders.map((folder) => describe(folder, ids.filter((id) => PACKAGE.exec(id)[1] === folder)));
  const short = ({ name, license }) => `${license.replace(/ AND /g, '-and-')}~${name.replace(/^@/, '').replace(/\//g, '-')}`;
  const head = [
    `Files: ${files}`,
    `Copyright: the zerodrift authors\n${packages.flatMap(({ holders }) => holders).map((holder) => ` ${holder}`).join('\n')}`,
    `License: ${['Apache-2.0', ...packages.map(short)].join(' and ')}`,
    `Comment: Bundled of zerodrift's own sources and of these packages of npm:\n${packages
      .map(({ name, version, license }) => ` ${name} ${version} (${license})`)
      .join('\n')}`,
  ].join('\n');
  return [head, ...packages.map((one) => `License: ${short(one)}\n${indented(one.text)}`)].join('\n\n') + '\n';
}
