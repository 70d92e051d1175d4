// Summary, the configuration's tables, rankings, the table of every cell, commands.

const outcomeMarks = { PASS: "✓", FAIL: "✗", VIOLATED: "!", INCONCLUSIVE: "?", "INCONCLUSIVE as planned": "?" };

function outcomeBadge(text, word = text) {
  const kind = word.split(" ")[0].toLowerCase();
  return element("span", { className: `badge ${kind}` }, `${outcomeMarks[word] ?? "·"} ${text}`);
}

const verdictWords = [
  ["pass", "PASS"], ["fail", "FAIL"], ["violated", "VIOLATED"], ["unexpected_open", "INCONCLUSIVE"],
  ["expected_open", "INCONCLUSIVE as planned"], ["errors", "error"], ["not_run", "not run"], ["unclaimed", "nothing claimed"],
];

function verdictTotals() {
  const counts = verdictWords.map(([key, word]) => [word, report.runs.reduce((sum, run) => sum + run.verdicts[key], 0)]);
  const badges = counts.filter(([, count]) => count > 0).map(([word, count]) => outcomeBadge(`${count} ${word}`, word));
  return element("p", { className: "totals" }, ...badges);
}

function winnersOf(scene) {
  return scene.ranking.filter((entry) => entry.rank === 1 && passes(report.cells[entry.cell]));
}

function claimTag(cell) {
  return cell.claims === "unbiased" || cell.claims === "exact" ? null : element("span", { className: "tag" }, cell.claims);
}

function winnerRow(scene) {
  const names = winnersOf(scene).flatMap((entry, i) => [i > 0 ? " = " : "", markedLabel(entry.label), claimTag(report.cells[entry.cell]) ?? ""]);
  const seconds = winnersOf(scene).map((entry) => formatSeconds(secondsTo(report.cells[entry.cell], 0)?.value));
  return [scene.short, element("span", {}, ...names), seconds.join(" = ")];
}

function winnersSentence(scenes) {
  const wins = new Map();
  for (const scene of scenes) for (const { label } of winnersOf(scene)) wins.set(label, (wins.get(label) ?? 0) + 1);
  const best = [...wins].sort((a, b) => b[1] - a[1]).map(([label, count]) => `${label} ${count}`);
  return `Fastest to 1 % error, alone or tied, in ${countOf(scenes.length, "scene")}: ${listed(best, 2)}`;
}

function buildSummary(body) {
  const winners = details("");
  const runs = report.runs.map((run) => run.file).join(", ");
  body.append(element("p", { className: "about" }, `${countOf(report.cells.length, "cell")} of ${runs}. ${report.version}`), verdictTotals(), winners);
  if (report.tables.length === 0 && report.scenes.length <= 12) winners.open = true;
  if (report.credits.length > 0) winners.after(details("Volumes shown and their makers", element("ul", {}, ...report.credits.map((line) => element("li", {}, line)))));
  return () => {
    const scenes = report.scenes.filter((scene) => winnersOf(scene).length > 0);
    winners.hidden = scenes.length === 0;
    winners.replaceChildren(
      element("summary", {}, winnersSentence(scenes)), plainTable(["scene", "fastest to 1 % (= tied)", "seconds a ray"], scenes.map(winnerRow)));
  };
}

// The configuration's tables, with the pictures of their cells.

const thumbnailKinds = ["mean", "error", "variance", "lookups"].map((name) => imageKinds[name]);

function cellsOfTable(table) {
  const places = table.rows.flatMap((row) => row.cells).filter((place) => place !== null);
  return [...new Set(places)].map((place) => report.cells[place]);
}

function columnsWithImages(table) {
  const hasOne = (column) => table.rows.some((row) => row.cells[column] !== null && hasImages(report.cells[row.cells[column]]));
  return table.columns.map((_, column) => column).filter(hasOne);
}

function thumbnailRanges(cells) {
  const shown = cells.filter(hasImages);
  return new Map([...thumbnailKinds, imageKinds.reference].map((kind) => {
    const light = kind.colours === greys && shown.some(imageKinds.reference.of);
    return [kind, light ? lightRange(shown) : sharedRange(kind, shown)];
  }));
}

function measurementOf(cell) {
  return cell.scene === null ? "" : report.scenes[cell.scene].measurement;
}

function measurementsOf(table, column) {
  const cells = table.rows.map((row) => row.cells[column]).filter((place) => place !== null).map((place) => report.cells[place]);
  return [...new Set(cells.map(measurementOf))].filter((text) => text !== "").join("; ");
}

function tableHead(table, pictured) {
  const top = [
    element("th", { scope: "col", rowSpan: 2 }, table.metric),
    ...table.columns.map((name) => element("th", { scope: "col", rowSpan: 2, className: "numeric" }, name)),
    ...(pictured.length > 0 ? [element("th", { scope: "col", rowSpan: 2 }, "reference")] : []),
    ...pictured.map((column) => {
      const measured = measurementsOf(table, column);
      return element("th", { scope: "colgroup", className: "group" }, table.columns[column], measured ? element("small", {}, ` ${measured}`) : "");
    }),
  ];
  const kinds = pictured.map(() => element("th", { className: "kinds" }, ...thumbnailKinds.map((kind) => element("span", {}, kind.title))));
  return element("thead", {}, tableRow(top), pictured.length > 0 ? tableRow(kinds) : null);
}

function tableValue(row, column) {
  const place = row.cells[column];
  const cell = place === null ? null : report.cells[place];
  const value = element("td", { className: "numeric" }, numberSpan(row.values[column], formatNumber, { key: "table", column: String(column) }));
  if (cell && cell.estimator !== cell.type) value.title = cell.estimator;
  return value;
}

/** The pictures of a row's cell, with the bias that makes its errors differ from noise. */
function pictureCell(place, ranges) {
  const cell = place === null ? null : report.cells[place];
  if (!cell || !hasImages(cell)) return element("td", { className: "pictures" });
  const pictures = thumbnailKinds.map((kind) => thumbnail(cell, kind, ranges.get(kind)));
  const bias = `bias ${cell.bias.map((x) => formatNumber(x, 2)).join(", ")}`;
  return element("td", { className: "pictures" }, element("div", {}, ...pictures), element("small", {}, `${cell.label}: ${bias}`));
}

function referenceCell(row, ranges) {
  const place = row.cells.find((candidate) => candidate !== null && hasImages(report.cells[candidate]));
  const picture = place === undefined ? null : thumbnail(report.cells[place], imageKinds.reference, ranges.get(imageKinds.reference));
  return element("td", { className: "pictures" }, element("div", {}, picture ?? ""));
}

function rowOfTable(table, row, index, pictured, ranges) {
  const note = row.note ? element("small", { className: "note" }, row.note) : null;
  const hasPictures = pictured.some((column) => row.cells[column] !== null && hasImages(report.cells[row.cells[column]]));
  const pictures = hasPictures
    ? [referenceCell(row, ranges), ...pictured.map((column) => pictureCell(row.cells[column], ranges))]
    : pictured.length > 0 ? [element("td", { colSpan: 1 + pictured.length }, note ?? "")] : [];
  const cells = [
    element("th", { scope: "row" }, row.label, hasPictures || pictured.length === 0 ? note : null),
    ...table.columns.map((_, column) => tableValue(row, column)),
    ...pictures,
  ];
  const made = tableRow(cells);
  made.dataset.row = String(index);
  return made;
}

function tableFigure(table, index) {
  const pictured = columnsWithImages(table);
  const ranges = pictured.length > 0 ? thumbnailRanges(cellsOfTable(table)) : new Map();
  const rows = table.rows.map((row, place) => rowOfTable(table, row, place, pictured, ranges));
  const made = element("table", { className: "comparison", dataset: { table: String(index) } }, tableHead(table, pictured), element("tbody", {}, ...rows));
  return { made: inScroller(made), ranges };
}

function tableKeys(ranges) {
  if (ranges.size === 0) return null;
  const keys = thumbnailKinds.map((kind) => scaleKey(kind, ranges.get(kind)));
  const reading = "Colour that fills an error picture is bias; specks of both colours are noise. Pictures of a kind share one scale:";
  return element("p", { className: "keys" }, reading, ...keys);
}

function buildTables(body) {
  report.tables.forEach((table, index) => {
    const { made, ranges } = tableFigure(table, index);
    body.append(element("h3", {}, table.title), made, tableKeys(ranges) ?? "");
  });
  return () => {};
}

// Rankings.

function rankText(entry) {
  if (entry.rank === null) return unknown;
  return entry.tied ? `=${entry.rank}` : String(entry.rank);
}

function reachedText(cell, place) {
  const target = secondsTo(cell, place);
  if (!target || !cell.time?.ns_per_sample) return unknown;
  return target.reached ? intervalText(target, formatSeconds) : "never";
}

function breakEvenText(scene, place) {
  const entry = scene.break_even.find(({ cell }) => cell === place);
  if (!entry) return "";
  if (entry.kind !== "at") return entry.kind;
  return `cheaper above an error of ${formatNumber(entry.error?.value, 2)} (${formatSeconds(entry.seconds?.value)})`;
}

function rankingRow(scene, entry) {
  const cell = report.cells[entry.cell];
  const { cost } = cell;
  const row = tableRow([
    rankText(entry),
    element("span", {}, markedLabel(entry.label), entry.cell === scene.baseline ? element("span", { className: "tag" }, "baseline") : "", claimTag(cell) ?? ""),
    intervalText(entry.relative), reachedText(cell, 0), reachedText(cell, 1), intervalText(cost?.variance),
    intervalText(cost?.variance_x_ns), intervalText(cost?.variance_x_lookups), cost?.floor ? intervalText(cost.floor) : "",
    breakEvenText(scene, entry.cell)]);
  row.dataset.ranked = String(entry.cell);
  return row;
}

const rankingHeadings = [
  "rank", "estimator", "cost relative to baseline", "seconds to 1 %", "seconds to .1 %", "variance", "variance × ns", "variance × lookups", "floor of the error",
  "against the best unbiased"];

function pairedTable(scene) {
  const pairs = report.paired.filter((pair) => pair.scene === scene.index && passes(report.cells[pair.cell]) && passes(report.cells[pair.against]));
  if (pairs.length === 0) return null;
  const rows = pairs.map((pair) => [
    markedLabel(report.cells[pair.cell].label), markedLabel(report.cells[pair.against].label), formatInterval(pair.ratio), formatInterval(pair.unpaired)]);
  return details("Mean squared errors on common random streams", plainTable(["estimator", "against", "ratio, paired", "ratio, not paired"], rows));
}

function showRanking(panel, scene) {
  const entries = scene.ranking.filter((entry) => passes(report.cells[entry.cell]));
  const table = element("table", { className: "ranking" }, headRow(rankingHeadings), element("tbody", {}, ...entries.map((entry) => rankingRow(scene, entry))));
  panel.append(element("div", {}, element("h4", {}, scene.short), inScroller(table), pairedTable(scene) ?? ""));
}

function buildRanking(body) {
  const update = scenePanels(body, (cell) => cell.cost !== null, showRanking);
  body.querySelector(".panels").classList.add("stacked");
  return update;
}

// Every cell.

function perOutput(key) {
  return (cell) => {
    const values = cell[key];
    const many = values.length > 1;
    const line = (value, i) => element("span", { className: "output" }, many ? element("small", {}, `${cell.outputs[i]} `) : "", numberSpan(value, formatNumber, { key }));
    return element("td", { className: "numeric" }, ...values.map(line));
  };
}

function single(key, of) {
  return (cell) => element("td", { className: "numeric" }, cell.status === "ok" ? numberSpan(of(cell), formatNumber, { key }) : "");
}

function textOf(of, title = of) {
  return (cell) => element("td", { title: title(cell) }, breakable(of(cell)));
}

function verdictReason(cell) {
  const parts = [cell.reason, cell.verdict?.reason];
  if (cell.verdict?.against === "own mean") parts.push("judged against its own mean");
  if (cell.verdict?.lookups === "FAIL") parts.push("lookups differ from their expectation");
  if (cell.verdict?.laws === "FAIL") parts.push("a law of its walks is broken");
  return parts.filter(Boolean).join("; ");
}

function sceneOfCell(cell) {
  return [cell.rays, cell.light, measurementOf(cell)].filter(Boolean).join(" · ");
}

const nanosecondsOf = (cell) => cell.time?.ns_per_sample?.value ?? null;
const firstOf = (key) => (cell) => cell[key][0] ?? null;

/** Columns of the table of every cell: how they are shown, and by what they are sorted. */
const cellColumns = [
  { title: "verdict", show: (cell) => element("td", {}, outcomeBadge(outcomeOf(cell))), sort: outcomeOf },
  { title: "estimator", show: (cell) => element("td", {}, markedLabel(cell.label)), sort: (cell) => cell.label },
  { title: "medium", show: textOf((cell) => shortMedium(cell.medium), (cell) => cell.medium), sort: (cell) => cell.medium },
  { title: "majorant", show: textOf((cell) => cell.majorant), sort: (cell) => cell.majorant },
  { title: "quantity", show: textOf((cell) => cell.quantity), sort: (cell) => cell.quantity },
  { title: "mean", show: perOutput("mean"), sort: firstOf("mean") },
  { title: "bias", show: perOutput("bias"), sort: firstOf("bias") },
  { title: "epsilon", show: single("epsilon", (cell) => cell.verdict?.epsilon ?? null), sort: (cell) => cell.verdict?.epsilon ?? null },
  { title: "RMSE", show: perOutput("rmse"), sort: firstOf("rmse") },
  { title: "variance", show: perOutput("variance"), sort: firstOf("variance") },
  { title: "lookups", show: single("lookups", (cell) => cell.lookups), sort: (cell) => cell.lookups },
  { title: "ns a sample", show: single("ns_per_sample", nanosecondsOf), sort: nanosecondsOf },
  { title: "samples a ray", show: single("samples", (cell) => cell.verdict?.samples_per_ray ?? cell.samples_per_ray), sort: (cell) => cell.samples_per_ray },
  { title: "rays, light", show: textOf(sceneOfCell), sort: sceneOfCell },
  { title: "why", show: textOf(verdictReason), sort: verdictReason },
];

const rowsOfPage = 100;

function cellRow(cell) {
  const row = tableRow(cellColumns.map((column) => column.show(cell)));
  row.dataset.cell = String(cell.index);
  return row;
}

/** What is unknown goes last, whichever way the rest is sorted. */
function compareBy(column, descending) {
  return (a, b) => {
    const [left, right] = [column.sort(a), column.sort(b)];
    if (left === null || right === null) return (left === null) - (right === null);
    const order = left < right ? -1 : Number(left > right);
    return descending ? -order : order;
  };
}

/** The table of every cell keeps its choices here. */
const cellTable = { column: null, descending: false, page: 0, outcome: "", words: "", allRows: false };

function searchText(cell) {
  return `${cell.name} ${cell.label} ${cell.quantity} ${cell.light} ${outcomeOf(cell)} ${verdictReason(cell)}`.toLowerCase();
}

function chosenCells() {
  const words = cellTable.words.toLowerCase().split(/\s+/);
  const chosen = passingCells().filter((cell) =>
    (cellTable.outcome === "" || outcomeOf(cell) === cellTable.outcome) && words.every((word) => searchText(cell).includes(word)));
  return cellTable.column ? chosen.sort(compareBy(cellTable.column, cellTable.descending)) : chosen;
}

function sortButton(column, update) {
  return button(column.title, () => {
    cellTable.descending = cellTable.column === column && !cellTable.descending;
    cellTable.column = column;
    cellTable.page = 0;
    update();
  });
}

function sortedWord(column) {
  if (cellTable.column !== column) return "none";
  return cellTable.descending ? "descending" : "ascending";
}

function cellTableControls(update) {
  const change = (key) => (value) => {
    cellTable[key] = value;
    cellTable.page = 0;
    update();
  };
  const outcomes = [...new Set(report.cells.map(outcomeOf))].sort();
  const choice = selectOf("Verdict", [["", "all"], ...outcomes.map((word) => [word, word])], change("outcome"));
  const search = element("input", { type: "search", id: "search", oninput: () => change("words")(search.value) });
  return element("div", { className: "controls" }, choice.label, element("label", { className: "choice" }, "Words in the name ", search));
}

function buildVerdicts(body) {
  const heads = cellColumns.map((column) => element("th", { scope: "col" }, sortButton(column, () => update())));
  const rows = element("tbody", {});
  const shown = element("span", { role: "status", id: "shown" });
  const turn = (pages) => () => {
    cellTable.page += pages;
    update();
  };
  const [back, on] = [button("Previous rows", turn(-1)), button("Next rows", turn(1))];
  const table = element("table", { className: "cells" }, element("thead", {}, tableRow(heads)), rows);
  body.append(cellTableControls(() => update()), inScroller(table), element("p", { className: "controls" }, back, on, shown));
  const update = () => {
    const cells = chosenCells();
    const first = cellTable.page * rowsOfPage;
    const page = cellTable.allRows ? cells : cells.slice(first, first + rowsOfPage);
    rows.replaceChildren(...page.map(cellRow));
    heads.forEach((head, i) => head.setAttribute("aria-sort", sortedWord(cellColumns[i])));
    back.disabled = first === 0;
    on.disabled = first + rowsOfPage >= cells.length;
    shown.textContent = cells.length === 0 ? "No cell" : `Rows ${first + 1} to ${Math.min(first + rowsOfPage, cells.length)} of ${cells.length}`;
  };
  return () => {
    cellTable.page = 0;
    update();
  };
}

// How to get the same again.

function commandBlock(lines) {
  return element("pre", { tabIndex: 0 }, lines.join("\n"));
}

function provenanceText(value) {
  if (Array.isArray(value)) return value.join(" ");
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
