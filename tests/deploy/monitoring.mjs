// SPDX-License-Identifier: Apache-2.0
// node monitoring.mjs ROOT METRICS: alerts, dashboard and operations page against each other and against what a console
// serves. METRICS is a file or the address of a running console, which is asked until nothing is missing, for a minute at
// most; what it said is then in metrics.txt. Writes dashboard_rules.yaml, the dashboard's expressions for promtool.
import {existsSync, readFileSync, writeFileSync} from "node:fs";
import YAML from "yaml";

const [root, source] = process.argv.slice(2);
const text = (name) => readFileSync(`${root}/${name}`, "utf8");
const rules = YAML.parse(text("deploy/monitoring/alerts.yaml")).groups.flatMap((group) => group.rules);
const alerts = rules.filter(({alert}) => alert);
const recorded = new Set(rules.map(({record}) => record));
const panels = JSON.parse(text("deploy/monitoring/dashboard.json")).panels;

const eventsName = "zerodrift_endpoint_events_total";  // has no series before the first event

function documentProblems() {
  const problems = [];
  const tests = YAML.parse(text("deploy/monitoring/alerts_test.yaml")).tests.flatMap((test) => test.alert_rule_test);
  const sections = [...text("deploy/OPERATIONS.md").matchAll(/^### (Zerodrift\w+)$/gm)].map(([, name]) => name);
  for (const {alert} of alerts) {
    const of = tests.filter(({alertname}) => alertname === alert);
    if (!of.some(({exp_alerts}) => exp_alerts.length > 0)) problems.push(`${alert}: no test in which it fires`);
    if (!of.some(({exp_alerts}) => exp_alerts.length === 0)) problems.push(`${alert}: no test in which it doesn't`);
    if (!sections.includes(alert)) problems.push(`${alert}: OPERATIONS.md has no section`);
  }
  for (const section of sections)
    if (!alerts.some(({alert}) => alert === section)) problems.push(`OPERATIONS.md: ${section} is no alert`);
  const cells = new Set();
  for (const {id, title, type, targets, gridPos: {x, y, w, h}} of panels) {
    if (!id || !title || !type || !(targets?.length > 0)) problems.push(`panel ${id ?? title}: incomplete`);
    if (x + w > 24) problems.push(`panel ${title}: beyond the grid`);
    for (let i = x; i < x + w; ++i) for (let j = y; j < y + h; ++j) {
      if (cells.has(`${i} ${j}`)) problems.push(`panel ${title}: covers another`);
      cells.add(`${i} ${j}`);
    }
  }
  // No healthy system's metrics have events of the middleware: by the code.
  const host = text("common/service/host.h");
  for (const {expr} of rules) for (const [, codes] of expr.matchAll(/\bevent=~"([\w|]+)"/g))
    for (const code of codes.split("|"))
      if (!host.includes(`"${code}"`)) problems.push(`alerts.yaml: no endpoint event '${code}' in common/service/host.h`);
  if (!text("services/console/metric_catalogue.h").includes(`"${eventsName}"`)) problems.push(`the console has no ${eventsName}`);
  return problems;
}

// name{label="value"} of an expression; of matchers only those for equality with something.
function selectors(expr) {
  return [...expr.matchAll(/(?<![\w:"$])([a-zA-Z_:][\w:]*)\s*(\{[^}]*\})?/g)]
    .filter(([, name]) => /^(zerodrift|node_|up$)/.test(name) && !recorded.has(name))
    .filter(([, name]) => name !== "up" && !name.startsWith("node_"))  // Prometheus's own and node_exporter's
    .filter(([, name]) => name !== eventsName)
    .map(([, name, braces]) => [name, [...(braces ?? "").matchAll(/(\w+)="([^"]+)"/g)].map(([, k, v]) => `${k}="${v}"`)]);
}

function missingIn(metrics) {
  const lines = metrics.split("\n").filter((line) => line !== "" && !line.startsWith("#"));
  const missing = new Set();
  const expressions = [...rules.map(({expr}) => expr), ...panels.flatMap(({targets}) => targets.map(({expr}) => expr))];
  let seen = 0;
  for (const [name, labels] of expressions.flatMap(selectors)) {
    ++seen;
    if (!lines.some((line) => /^[\w:]+/.exec(line)[0] === name && labels.every((label) => line.includes(label))))
      missing.add(`no series ${name}{${labels}} is served`);
  }
  if (seen < 20) missing.add(`only ${seen} series are asked for: they are not found in the expressions`);
  return [...missing];
}

async function metricProblems() {
  if (existsSync(source)) return missingIn(readFileSync(source, "utf8"));
  let problems = [];
  for (let second = 0; second < 60; ++second) {
    try {
      const metrics = await (await fetch(source)).text();
      writeFileSync("metrics.txt", metrics);
      problems = missingIn(metrics);
      if (problems.length === 0) break;
    } catch (error) {
      problems = [`${source}: ${error.message}`];
    }
    await new Promise((resolve) => setTimeout(resolve, 1000));
  }
  return problems;
}

writeFileSync("dashboard_rules.yaml", YAML.stringify({groups: [{name: "dashboard", rules: panels.flatMap(({id, targets}) =>
  targets.map(({refId, expr}) => ({record: `dashboard:panel_${id}_${refId}`, expr})))}]}));
const problems = [...documentProblems(), ...(source ? await metricProblems() : [])];
for (const problem of problems) console.log(problem);
console.log(`${alerts.length} alerts, ${panels.length} panels, ${problems.length} problems`);
process.exit(problems.length > 0 ? 1 : 0);
