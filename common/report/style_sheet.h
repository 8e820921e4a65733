// SPDX-License-Identifier: Apache-2.0
// How a report looks. Pictures stay on white, also in the dark and on paper.
#pragma once

#include <string_view>

namespace zerodrift::report {

inline constexpr std::string_view kStyleSheet = R"css(:root {
  --page: #fff; --text: #1b2126; --soft: #57606a; --rule: #d0d7de; --faint: #f3f5f7;
  --accent: #0060a0; --mark: #e3f0fa;
}
@media screen and (prefers-color-scheme: dark) {
  :root {
    --page: #14181c; --text: #e4e8eb; --soft: #a0abb5; --rule: #3a434c; --faint: #1d2329;
    --accent: #6cb6ff; --mark: #17324a;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--page); color: var(--text);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", "Liberation Sans", sans-serif;
}
main { max-width: 56rem; margin: 0 auto; padding: 2rem 1rem 4rem; }
h1, h2, h3 { line-height: 1.25; text-wrap: balance; overflow-wrap: anywhere; }
h1 { margin: 0; font-size: 1.75rem; }
h2 { margin: 2.5rem 0 0.75rem; padding-bottom: 0.3rem; border-bottom: 1px solid var(--rule); font-size: 1.3rem; }
h3 { margin: 1.75rem 0 0.5rem; font-size: 1.08rem; }
p { margin: 0.75rem 0; overflow-wrap: anywhere; }
.subtitle { margin-top: 0.35rem; color: var(--soft); }
.verdict {
  margin: 1.25rem 0; padding: 0.85rem 1.1rem; border-left: 4px solid var(--accent);
  background: var(--faint); font-size: 1.08rem;
}
.doubt { margin: 0.75rem 0; padding: 0.5rem 1.1rem; border-left: 4px double var(--text); }
.contents { margin: 1.25rem 0; columns: 20rem; column-gap: 2rem; font-size: 0.94rem; }
.contents ul { margin: 0; padding: 0; list-style: none; }
.contents li { padding: 0.1rem 0; break-inside: avoid; overflow-wrap: anywhere; }
.contents .table { padding-left: 1.2rem; }
a { color: var(--accent); }
sup a { padding: 0 0.15em; text-decoration: none; }
.scroll { overflow-x: auto; }
.scroll:focus-visible, a:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
table { border-collapse: collapse; margin: 1.25rem 0; font-size: 0.94rem; font-variant-numeric: tabular-nums; }
caption {
  width: max-content; max-width: min(54rem, 100vw - 2rem); padding-bottom: 0.5rem;
  text-align: left; color: var(--soft);
}
caption b, figcaption b { color: var(--text); }
th, td { padding: 0.36rem 0.8rem; border-bottom: 1px solid var(--rule); text-align: left; vertical-align: baseline; }
thead th { border-bottom: 2px solid var(--soft); vertical-align: bottom; }
tbody th { font-weight: 400; }
.right { text-align: right; }
td.right { white-space: nowrap; }
.highlighted > * { background: var(--mark); font-weight: 700; }
.highlighted > th { box-shadow: inset 4px 0 0 var(--accent); }
figure { margin: 1.75rem 0; }
figure .scroll { border: 1px solid var(--rule); border-radius: 6px; background: #fff; }
figure svg { display: block; width: 100%; min-width: 34rem; height: auto; }
figure svg text { paint-order: stroke; stroke: #fff; stroke-width: 4px; stroke-linejoin: round; }
figcaption { margin-top: 0.6rem; font-size: 0.94rem; color: var(--soft); }
.footnotes { margin-top: 3rem; border-top: 1px solid var(--rule); font-size: 0.88rem; color: var(--soft); }
.footnotes ol { padding-left: 1.4rem; }
@page { margin: 18mm 16mm; }
@media print {
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  .contents { display: none; }
  h2, h3 { break-after: avoid; }
  figure, tr, .verdict, .doubt { break-inside: avoid; }
  thead { display: table-header-group; }
  .scroll { overflow: visible; }
  table { font-size: 8.5pt; }
  caption { max-width: 100%; }
  figure svg { min-width: 0; }
  .verdict, .highlighted > * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
)css";

}  // namespace zerodrift::report
