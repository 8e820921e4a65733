// SPDX-License-Identifier: Apache-2.0
// The documents as pages for the console to serve under /docs: docs/README.md is the index, and what its table links to is there.
// A link to anything else names the file in the sources.
//   docs.mjs DOCS OUT
import { copyFileSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { basename, dirname, join, relative, resolve } from 'node:path';
import { Marked, Renderer } from 'marked';

const [docs, out] = process.argv.slice(2);
const index = resolve(docs, 'README.md');
const rows = [...readFileSync(index, 'utf8').matchAll(/^\| \[[^\]]+\]\(([^)]+\.md)\) \| .+ \|$/gm)];
if (rows.length === 0) throw new Error(`${index}: found no row that links to a page`);
const pages = new Map(rows.map(([, file]) => [resolve(docs, file), `${basename(file, '.md').toLowerCase()}.html`]));
pages.set(index, 'index.html');

const escaped = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('"', '&quot;');
// As the repository's pages name their headings.
const slug = (heading) => heading.toLowerCase().replace(/[^\p{L}\p{N} _-]/gu, '').replaceAll(' ', '-');
const inSources = (file) => escaped(relative(dirname(docs), file));

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });

function rendered(source) {
  const marked = new Marked({
    renderer: {
      heading({ tokens, depth, text }) {
        return `<h${depth} id="${escaped(slug(text))}">${this.parser.parseInline(tokens)}</h${depth}>\n`;
      },
      link({ href, tokens }) {
        const text = this.parser.parseInline(tokens);
        if (/^https?:/.test(href)) return `<a href="${escaped(href)}">${text}</a>`;
        const [file, anchor] = href.split('#');
        const target = file === '' ? source : resolve(dirname(source), file);
        const page = pages.get(target);
        if (page === undefined) return `${text} (<code>${inSources(target)}</code>)`;
        return `<a href="${page}${anchor === undefined ? '' : `#${escaped(anchor)}`}">${text}</a>`;
      },
      image({ href, text }) {
        copyFileSync(resolve(dirname(source), href), join(out, basename(href)));
        return `<img src="${escaped(basename(href))}" alt="${escaped(text)}">`;
      },
      code({ text }) {
        return `<pre tabindex="0"><code>${escaped(text)}</code></pre>\n`;
      },
      // A table is as wide as it is, within a phone's page.
      table(token) {
        return `<div class="table" tabindex="0">${Renderer.prototype.table.call(this, token)}</div>\n`;
      },
    },
  });
  return marked.parse(readFileSync(source, 'utf8'));
}

for (const [source, page] of pages) {
  const title = /^# (.+)$/m.exec(readFileSync(source, 'utf8'))?.[1].replaceAll('`', '') ?? basename(source, '.md');
  const ways = page === 'index.html' ? '' : '<a href="./">Documents</a> ';
  writeFileSync(
    join(out, page),
    `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>${escaped(title)} - zerodrift</title>
<link rel="stylesheet" href="docs.css">
</head>
<body>
<nav>${ways}<a href="../">Console</a></nav>
<main>
${rendered(source)}</main>
</body>
</html>
`,
  );
}
writeFileSync(
  join(out, 'docs.css'),
  `body { margin: 0 auto; max-width: 50rem; padding: 1rem; background: Canvas; color: CanvasText; font: 1rem/1.55 system-ui, sans-serif; }
nav a { margin-right: 1rem; }
pre, .table { overflow-x: auto; }
pre { padding: 0.75rem; border: 1px solid GrayText; border-radius: 4px; line-height: 1.35; }
code { font-size: 0.875rem; }
table { border-collapse: collapse; }
th, td { padding: 0.3rem 0.6rem; border: 1px solid GrayText; text-align: left; vertical-align: top; }
img { max-width: 100%; }
`,
);
