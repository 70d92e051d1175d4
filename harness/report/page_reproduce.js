// How to get the same again.

function commandBlock(lines) {
  return element("pre", { tabIndex: 0 }, lines.join("\n"));
}

function provenanceText(value) {
  if (Array.isArray(value)) return value.map(provenanceText).join(value.some((one) => one !== null && typeof one === "object") ? "; " : " ");
  if (value !== null && typeof value === "object") return Object.entries(value).map(([key, inner]) => `${key} ${provenanceText(inner)}`).join(", ");
  return String(value);
}

function provenanceTable(run) {
  const rows = [["configuration's hash", run.config_hash], ...Object.entries(run.provenance).map(([key, value]) => [key.replaceAll("_", " "), provenanceText(value)])];
  return element("table", { className: "provenance" }, element("tbody", {}, ...rows.map(([key, text]) => tableRow([element("th", { scope: "row" }, key), text]))));
}

function buildReproduce(body) {
  body.append(element("h3", {}, "This page"), commandBlock([report.command]));
  for (const run of report.runs)
    body.append(element("h3", {}, run.name), commandBlock(run.commands), details("Provenance", inScroller(provenanceTable(run))));
  return () => {};
}
