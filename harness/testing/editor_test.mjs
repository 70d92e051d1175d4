// node editor_test.mjs NULLMARK   the schema in the language service of VS Code's JSON editor, of npm's package
// vscode-json-languageservice in the current folder: it accepts the shipped configurations, marks mistakes, and proposes names.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";

const { getLanguageService, TextDocument } = createRequire(process.cwd() + "/")("vscode-json-languageservice");
const program = process.argv[2];
const configs = new URL("../../configs/", import.meta.url);
const schema = JSON.parse(execFileSync(program, ["schema", "config"], { maxBuffer: 1 << 26 }));
const service = getLanguageService({});
service.configure({ validate: true, schemas: [{ uri: "nullmark://config", fileMatch: ["*.json"], schema }] });

const documentOf = (text) => TextDocument.create("file:///config.json", "json", 1, text);

async function problems(text) {
  const document = documentOf(text);
  return (await service.doValidation(document, service.parseJSONDocument(document))).map(({ message }) => message);
}

/** What the editor proposes at the bar in a text. */
async function proposals(text) {
  const document = documentOf(text.replace("|", ""));
  const list = await service.doComplete(document, document.positionAt(text.indexOf("|")), service.parseJSONDocument(document));
  return list.items.map(({ label }) => label.replaceAll('"', ""));
}

const experiment = (inner) => `{"nullmark":"config/2","experiments":[{"name":"e",${inner}}]}`;

for (const name of readdirSync(configs).filter((file) => file.endsWith(".json")))
  assert.deepEqual(await problems(readFileSync(new URL(name, configs), "utf8")), [], name);
const mistaken = await problems(experiment('"rays":"single","samples_per_ray":1,"matrix":{"estimator":"ratioo","medium":"linear"}'));
assert.equal(mistaken.length, 1);
assert.match(mistaken[0], /"ratio"/);
assert.equal((await problems(experiment('"samples_per_ray":-1'))).length > 0, true);
const keys = await proposals(experiment("|"));
for (const key of ["estimator", "medium", "verdict", "minus"]) assert.ok(keys.includes(key), key);
const trackers = await proposals(experiment('"matrix":{"estimator":["|"]}'));
for (const tracker of ["delta", "ratio", "spectral"]) assert.ok(trackers.includes(tracker), tracker);
const parameters = await proposals(experiment('"matrix":{"medium":[{"type":"vdb",|}]}'));
for (const parameter of ["file", "grid", "optical_depth", "albedo"]) assert.ok(parameters.includes(parameter), parameter);
console.log("the editor's language service accepts the shipped configurations, marks mistakes and proposes names");
