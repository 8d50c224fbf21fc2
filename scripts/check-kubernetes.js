// The part of scripts/check-kubernetes that knows YAML: node check-kubernetes.js TOOLS CONTAINERS
"use strict";
const fs = require("fs");
const path = require("path");
const Ajv = require("ajv").default;
const ts = require("typescript");
const yaml = require("yaml");

const [tools, containers] = process.argv.slice(2);
const models = path.resolve(tools, "node_modules/kubernetes-models");

// "apps/v1" StatefulSet -> kubernetes-models/apps/v1, StatefulSet
function moduleOf(object) {
  const version = String(object.apiVersion);
  const folder = path.join(models, version);
  if (!/^[a-z0-9.\/]+$/.test(version) || !fs.existsSync(path.join(folder, `${object.kind}.js`))) return null;
  return `kubernetes-models/${version}`;
}

// Required fields, formats and values.
function valueProblems(object) {
  const model = require(moduleOf(object))[object.kind];
  try {
    new model(object).validate();
    return [];
  } catch (error) {
    return String(error.message).split("\n");
  }
}

// Fields that Kubernetes does not know, and types. An object written down as a literal may have no field too many.
function fieldProblems(objects) {
  const file = path.resolve(tools, "objects.ts");
  const text = objects.map((object, i) =>
    `import {I${object.kind} as T${i}} from "${moduleOf(object)}";\n` +
    `export const object${i}: T${i} = ${JSON.stringify(object, null, 1)};\n`).join("");
  fs.writeFileSync(file, text);
  const program = ts.createProgram([file], {
    noEmit: true, strict: true, skipLibCheck: true, types: [],
    module: ts.ModuleKind.CommonJS, moduleResolution: ts.ModuleResolutionKind.Node10,
  });
  return ts.getPreEmitDiagnostics(program).map((found) => {
    const said = ts.flattenDiagnosticMessageText(found.messageText, " ");
    if (!found.file) return said;
    const {line} = found.file.getLineAndCharacterOfPosition(found.start);
    return `at ${found.file.text.split("\n")[line].trim()} ${said}`;
  });
}

function kubernetesProblems(text) {
  const documents = yaml.parseAllDocuments(text);
  const broken = documents.flatMap((document) => document.errors.map((error) => error.message));
  if (broken.length > 0) return broken;
  const objects = documents.map((document) => document.toJS());
  const unknown = objects.filter((object) => !object || !moduleOf(object));
  if (unknown.length > 0)
    return unknown.map((object) => `Kubernetes has no ${object?.kind} of ${object?.apiVersion}`);
  return [...objects.flatMap(valueProblems), ...fieldProblems(objects)];
}

const composeSchema = JSON.parse(
  fs.readFileSync(path.resolve(tools, "node_modules/dclint/schemas/compose.schema.json"), "utf8"));
delete composeSchema.$schema;  // names draft 7, which is what Ajv expects, by an address that it does not know
const fitsCompose = new Ajv({strict: false, allErrors: true, validateFormats: false}).compile(composeSchema);

function composeProblems(text) {
  const document = yaml.parseDocument(text, {merge: true});
  if (document.errors.length > 0) return document.errors.map((error) => error.message);
  if (fitsCompose(document.toJS())) return [];
  return fitsCompose.errors.map((error) => `${error.instancePath} ${error.message} ${JSON.stringify(error.params)}`);
}

let failed = false;
function check(file, problemsOf, mistakes) {
  const text = fs.readFileSync(file, "utf8");
  const problems = problemsOf(text);
  for (const problem of problems) console.log(`${file}: ${problem}`);
  failed ||= problems.length > 0;
  let refused = 0;
  for (const [right, wrong] of mistakes) {
    if (!text.includes(right)) {
      console.log(`${file}: there is no '${right}' to put a mistake into; mend scripts/check-kubernetes.js`);
      failed = true;
    } else if (problemsOf(text.replace(right, wrong)).length === 0) {
      console.log(`${file}: '${wrong}' instead of '${right}' was not refused: this check is worth nothing`);
      failed = true;
    } else {
      ++refused;
    }
  }
  if (problems.length === 0) console.log(`${file}: fits; ${refused} of ${mistakes.length} planted mistakes refused`);
}

const folder = path.join(containers, "kubernetes");
const mistakesOf = {
  "core.yaml": [
    ["readinessProbe:", "readynessProbe:"],                           // a field that is none
    ["terminationGracePeriodSeconds: 900", "terminationGracePeriodSeconds: long"],
    ["serviceName: comap-core", "servicename: comap-core"],
    ["seccompProfile: {type: RuntimeDefault}", "seccompProfile: {}"],  // a field that must be there
    ["memory: 1Gi", "memory: much"],                                   // a value of another form
    ["kind: StatefulSet", "kind: StatefullSet"],
    ["emptyDir: {medium: Memory, sizeLimit: 1Mi}", "emptyDir: {medium: Memory, size: 1Mi}"],
    ["dnsPolicy: ClusterFirstWithHostNet", "dnsPolicy: HostNet"],
  ],
  "discovery.yaml": [
    ["protocol: UDP, targetPort", "protokoll: UDP, targetPort"],
    ["type: LoadBalancer", "type: Balancer"],
    ["externalTrafficPolicy: Local", "externalTraffic: Local"],
    ["strategy: {type: Recreate}", "strategy: Recreate"],
    ["exec: {command:", "exec: {commands:"],
  ],
};
for (const name of fs.readdirSync(folder).filter((file) => file.endsWith(".yaml")))
  check(path.join(folder, name), kubernetesProblems, mistakesOf[name] ?? []);
check(path.join(containers, "compose.yaml"), composeProblems, [
  ["stop_grace_period:", "stop_grace_time:"],
  ["condition: service_healthy", "condition: healthy"],
  ["tmpfs: [/tmp]", "tmpfs: {path: /tmp}"],
]);
process.exit(failed ? 1 : 0);
