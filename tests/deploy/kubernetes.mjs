// SPDX-License-Identifier: Apache-2.0
// node kubernetes.mjs RENDERED.yaml...: every object by its schema (validators of kubernetes-models), no key that its type
// doesn't know (the compiler's check of object literals against the types), and this project's rules. Writes options.txt:
// "program --option", one a line.
import {readFileSync, writeFileSync} from "node:fs";
import ts from "typescript";
import YAML from "yaml";

const problems = [];
const options = new Set();

async function modelOf(object) {
  const path = object.apiVersion === "v1" ? "v1" : object.apiVersion;
  try {
    return (await import(`kubernetes-models/${path}/${object.kind}`))[object.kind];
  } catch {
    return undefined;
  }
}

async function checkSchema(where, object) {
  const Model = await modelOf(object);
  if (Model === undefined) return problems.push(`${where}: there is no ${object.apiVersion} ${object.kind}`);
  try {
    new Model(object).validate();
  } catch (error) {
    problems.push(`${where}: ${error.message}`);
  }
}

// Object literals may have no key that the interface lacks, at any depth.
function checkUnknownKeys(objects) {
  const file = "unknown-keys.ts";
  writeFileSync(file, objects.map(({object}, i) =>
    `import type {I${object.kind} as T${i}} from "kubernetes-models/${object.apiVersion}/${object.kind}";\n` +
    `export const o${i}: T${i} = ${JSON.stringify(object, null, 1)};\n`).join(""));
  const program = ts.createProgram([file], {noEmit: true, strict: true, skipLibCheck: true, module: ts.ModuleKind.ESNext,
    moduleResolution: ts.ModuleResolutionKind.Node10, target: ts.ScriptTarget.ES2022, types: []});
  for (const diagnostic of ts.getPreEmitDiagnostics(program))
    problems.push(`keys: ${ts.flattenDiagnosticMessageText(diagnostic.messageText, " ")}`);
}

function checkRules(where, {kind, spec}) {
  if (kind !== "StatefulSet") return;
  const pod = spec.template.spec;
  const rule = (holds, text) => holds || problems.push(`${where}: ${text}`);
  rule(pod.securityContext.runAsNonRoot && pod.securityContext.runAsUser === 10001, "not user 10001");
  rule(pod.securityContext.seccompProfile?.type === "RuntimeDefault", "no seccomp profile");
  rule(pod.automountServiceAccountToken === false, "an account's token is mounted");
  rule(!pod.hostNetwork && !pod.hostIPC && !pod.hostPID, "shares a namespace of the host");
  for (const volume of pod.volumes ?? []) {
    rule(!volume.hostPath, `volume ${volume.name} is of the host`);
    rule(!volume.emptyDir || volume.emptyDir.sizeLimit, `volume ${volume.name} has no limit`);
  }
  const health = new Set();
  for (const c of pod.containers) {
    const of = `container ${c.name}`;
    rule(/:\d[\w.-]*$/.test(c.image), `${of}: image ${c.image} has no version`);
    rule(c.securityContext.readOnlyRootFilesystem && c.securityContext.allowPrivilegeEscalation === false &&
      c.securityContext.capabilities.drop.includes("ALL") && !c.securityContext.privileged, `${of}: not confined`);
    rule(c.resources.requests.cpu && c.resources.requests.memory && c.resources.limits.memory, `${of}: no limits`);
    rule(c.startupProbe && c.readinessProbe && c.livenessProbe, `${of}: a probe is missing`);
    const file = c.env.find(({name}) => name === "ZERODRIFT_HEALTH_FILE")?.value;
    rule(file && !health.has(file), `${of}: health file ${file} is none of its own`);
    health.add(file);
    for (const word of c.args ?? []) if (word.startsWith("--")) options.add(`${c.command[0]} ${word}`);
    for (const mount of c.volumeMounts)
      rule([...pod.volumes, ...(spec.volumeClaimTemplates ?? []).map((claim) => claim.metadata)].some(({name}) => name === mount.name),
        `${of}: there is no volume ${mount.name}`);
  }
}

const objects = [];
for (const file of process.argv.slice(2)) {
  for (const document of YAML.parseAllDocuments(readFileSync(file, "utf8"), {merge: true})) {
    for (const error of document.errors) problems.push(`${file}: ${error.message}`);
    const object = document.toJS();
    const where = `${file}: ${object.kind} ${object.metadata?.name}`;
    objects.push({where, object});
    await checkSchema(where, object);
    try {
      checkRules(where, object);
    } catch (error) {
      problems.push(`${where}: ${error.message}`);
    }
  }
}
if (objects.length === 0) problems.push("there is no object");
checkUnknownKeys(objects);
writeFileSync("options.txt", [...options].map((line) => line + "\n").join(""));
for (const problem of problems) console.log(problem);
console.log(`${objects.length} objects, ${problems.length} problems`);
process.exit(problems.length > 0 ? 1 : 0);
