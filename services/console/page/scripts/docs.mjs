// SPDX-License-Identifier: Apache-2.0
// The documents for the console to serve under /docs: as they are, which a browser shows as text, with an index made of the table in
// docs/README.md.
//   docs.mjs DOCS OUT
import { copyFileSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';

const [docs, out] = process.argv.slice(2);
const rows = [...readFileSync(join(docs, 'README.md'), 'utf8').matchAll(/^\| \[([^\]]+)\]\(([^)]+\.md)\) \| (.+) \|$/gm)];
if (rows.length === 0) throw new Error(`${join(docs, 'README.md')}: found no row that links to a page`);

const html = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replace(/`([^`]+)`/g, '<code>$1</code>');

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
for (const [, , file] of rows) copyFileSync(join(docs, file), join(out, basename(file)));
const items = rows.map(([, name, file, says]) => `<dt><a href="${basename(file)}">${html(name)}</a></dt>\n<dd>${html(says)}</dd>`);
writeFileSync(
  join(out, 'index.html'),
  `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>zerodrift: documents</title>
</head>
<body>
<main>
<h1>Documents</h1>
<p>Of the version that runs here, as text. <a href="../">To the console</a></p>
<dl>
${items.join('\n')}
</dl>
</main>
</body>
</html>
`,
);
