// Summary, the configuration's tables, rankings, the table of every cell, commands.

const outcomeMarks = { PASS: "✓", FAIL: "✗", VIOLATED: "!", INCONCLUSIVE: "?", "INCONCLUSIVE (as planned)": "?" };

function outcomeBadge(text, word = text, more = {}) {
  const kind = word.split(" ")[0].toLowerCase();
  return element(more.href ? "a" : "span", { className: `badge ${kind}`, ...more }, `${outcomeMarks[word] ?? "·"} ${text}`);
}

const outcomeMeanings = {
  PASS: "a bias above epsilon is ruled out",
  FAIL: "bias is proven, or lookups or walks break a law",
  INCONCLUSIVE: "neither bias nor its absence is proven, though the plan foresaw a decision",
  "INCONCLUSIVE (as planned)": "the plan said beforehand that no affordable number of samples decides",
  "nothing claimed": "the estimator claims nothing here, nothing was tested, or the configuration disables the verdict",
};

function violationsText() {
  const cells = report.cells.filter((cell) => outcomeOf(cell) === "VIOLATED");
  const lookups = cells.reduce((sum, cell) => sum + cell.violations, 0);
  const largest = Math.max(...cells.map((cell) => cell.largest_violation ?? 1));
  return `needs a majorant that bounds the extinction: ${countOf(lookups, "lookup")} above the bound, largest ratio ${formatNumber(largest, 3)}`;
}

function outcomeMeaning(word) {
  return word === "VIOLATED" ? violationsText() : outcomeMeanings[word] ?? "see the reasons in the table of every cell";
}

const verdictWords = ["PASS", "FAIL", "VIOLATED", "INCONCLUSIVE", "INCONCLUSIVE (as planned)", "ERROR", "not run", "nothing claimed"];

/** How many cells of a word have each mark: "(3 by pilot, 1 own mean)". */
function marksText(cells) {
  const counts = new Map();
  for (const mark of cells.flatMap((cell) => cell.marks)) counts.set(mark, (counts.get(mark) ?? 0) + 1);
  return counts.size === 0 ? "" : element("small", {}, `(${[...counts].map(([mark, count]) => `${count} ${mark}`).join(", ")}) `);
}

function verdictTotals() {
  const cells = verdictWords.map((word) => [word, report.cells.filter((cell) => outcomeOf(cell) === word)]);
  const badges = cells.filter(([, of]) => of.length > 0).flatMap(([word, of]) =>
    [outcomeBadge(`${of.length} ${word}`, word, { href: "#verdicts", title: outcomeMeaning(word), onclick: () => chooseOutcome(word) }), marksText(of)]);
  return element("p", { className: "totals" }, ...badges);
}

function winnersOf(scene) {
  return scene.ranking.filter((entry) => entry.rank === 1 && passes(report.cells[entry.cell]));
}

/** The fastest of those that claim to be unbiased, with whom it is tied. */
function unbiasedWinnersOf(scene) {
  const entries = scene.ranking.filter((entry) => entry.rank !== null && passes(report.cells[entry.cell]) && claimsUnbiased(report.cells[entry.cell]));
  const best = Math.min(...entries.map(({ rank }) => rank));
  return entries.filter(({ rank }) => rank === best);
}

function claimTag(cell) {
  return cell.claims === "unbiased" || cell.claims === "exact" ? null : element("span", { className: "tag" }, cell.claims);
}

function namesAndSeconds(entries) {
  const names = entries.flatMap((entry, i) => [i > 0 ? " = " : "", markedLabel(entry.label), claimTag(report.cells[entry.cell]) ?? ""]);
  const seconds = entries.map((entry) => formatSeconds(secondsTo(report.cells[entry.cell], 0)?.value));
  return [element("span", {}, ...names), seconds.join(" = ")];
}

function winnerRow(scene) {
  return [scene.short, ...namesAndSeconds(winnersOf(scene)), ...namesAndSeconds(unbiasedWinnersOf(scene))];
}

function tally(scenes, winners) {
  const wins = new Map();
  for (const scene of scenes) for (const { label } of winners(scene)) wins.set(label, (wins.get(label) ?? 0) + 1);
  return listed([...wins].sort((a, b) => b[1] - a[1]).map(([label, count]) => `${label} in ${countOf(count, "scene")}`), 2);
}

function winnersSentence(scenes) {
  const unbiased = tally(scenes, unbiasedWinnersOf);
  const best = unbiased ? `; best unbiased: ${unbiased}` : "";
  return `Fastest to 1\u00a0% error, alone or tied, of ${countOf(scenes.length, "scene")}: ${tally(scenes, winnersOf)}${best}`;
}

function versionsText() {
  const measured = [...new Set(report.runs.map(({ version }) => version))];
  return `Measured by ${listed(measured)}; page by ${report.version}`;
}

/** What a reader must know of the results before trusting or missing something. */
function remarkLines() {
  const lines = report.runs.flatMap((run) => run.remarks.map((remark) => `${run.file}: ${remark}`));
  if (!anythingTimed) lines.push("Nothing was timed (--no-timing, or the configuration disables it), so columns and plots of time are left out.");
  return lines.map((line) => element("p", { className: "remark" }, line));
}

function buildSummary(body) {
  const winners = details("");
  const runs = report.runs.map((run) => run.file).join(", ");
  body.append(
    element("p", { className: "about" }, `${countOf(report.cells.length, "cell")} of ${runs}. ${versionsText()}`), ...remarkLines(), verdictTotals(), winners);
  if (report.tables.length === 0 && report.scenes.length <= 12) winners.open = true;
  if (report.credits.length > 0) winners.after(details("Volumes shown and their makers", element("ul", {}, ...report.credits.map((line) => element("li", {}, line)))));
  return () => {
    const scenes = report.scenes.filter((scene) => winnersOf(scene).length > 0);
    winners.hidden = scenes.length === 0;
    winners.replaceChildren(
      element("summary", {}, winnersSentence(scenes)), plainTable(["scene", "fastest to 1\u00a0% (= tied)", "seconds a ray", "fastest unbiased", "seconds a ray"], scenes.map(winnerRow)));
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
  const note = row.note ? element("small", { className: "note" }, withPageNumbers(row.note)) : null;
  const hasPictures = pictured.some((column) => row.cells[column] !== null && hasImages(report.cells[row.cells[column]]));
  const pictures = hasPictures
    ? [referenceCell(row, ranges), ...pictured.map((column) => pictureCell(row.cells[column], ranges))]
    : pictured.length > 0 ? [element("td", { colSpan: 1 + pictured.length }, note ?? "")] : [];
  const cells = [
    element("th", { scope: "row" }, withPageNumbers(row.label), hasPictures || pictured.length === 0 ? note : null),
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
    body.append(element("h3", {}, withPageNumbers(table.title)), made, tableKeys(ranges) ?? "");
  });
  return () => {};
}

// Rankings.

function rankText(entry) {
  if (entry.rank === null) return unknown;
  return entry.tied ? `${entry.rank}=` : String(entry.rank);
}

function reachedText(cell, place) {
  const target = secondsTo(cell, place);
  if (!target || !cell.time?.ns_per_sample) return unknown;
  if (!target.reached) return "never";
  const text = intervalText(target, formatSeconds);
  return target.amortised ? element("span", {}, "~", text) : text;
}

function breakEvenText(scene, place) {
  const entry = scene.break_even.find(({ cell }) => cell === place);
  if (!entry) return "";
  if (entry.kind !== "at") return entry.kind;
  return `cheaper above an error of ${formatPercent(entry.error?.value)} (${formatSeconds(entry.seconds?.value)})`;
}

function estimatorCell(scene, entry, cell) {
  const baseline = entry.cell === scene.baseline ? element("span", { className: "tag" }, "baseline") : "";
  return element("span", {}, markedLabel(entry.label), baseline, claimTag(cell) ?? "");
}

/** Columns of a ranking; those of times are left out where nothing was timed. */
const rankingColumns = [
  { title: "rank", timed: true, of: (_, entry) => rankText(entry) },
  { title: "estimator", of: estimatorCell },
  { title: "cost relative to baseline", timed: true, of: (_, entry) => intervalText(entry.relative) },
  { title: "seconds to\u00a01\u00a0%", timed: true, of: (_, __, cell) => reachedText(cell, 0) },
  { title: "seconds to\u00a00.1\u00a0%", timed: true, of: (_, __, cell) => reachedText(cell, 1) },
  { title: "variance", of: (_, __, cell) => intervalText(cell.cost?.variance) },
  { title: "variance × ns", timed: true, of: (_, __, cell) => intervalText(cell.cost?.variance_x_ns) },
  { title: "variance × lookups", of: (_, __, cell) => intervalText(cell.cost?.variance_x_lookups) },
  { title: "floor of the error", of: (_, __, cell) => (floorText(cell) ? intervalText(cell.cost.floor, formatPercent) : "") },
  { title: "against the best unbiased", timed: true, of: (scene, entry) => breakEvenText(scene, entry.cell) },
].filter(({ timed }) => anythingTimed || !timed);

function rankingRow(scene, entry) {
  const row = tableRow(rankingColumns.map(({ of }) => of(scene, entry, report.cells[entry.cell])));
  row.dataset.ranked = String(entry.cell);
  return row;
}

function amortisedNote(entries) {
  const some = entries.some((entry) => report.cells[entry.cell].cost?.seconds.some(({ amortised }) => amortised));
  return some ? element("p", { className: "says" }, "~ fewer samples are needed than shared a walk through the majorant structure when they were timed.") : "";
}

function unpairedText(scene) {
  const reasons = report.unpaired.filter((one) => one.scene === scene.index && passes(report.cells[one.cell]));
  return reasons.length === 0 ? "" : `Not paired: ${reasons.map((one) => `${report.cells[one.cell].label} ${one.reason}`).join("; ")}.`;
}

/** The error of one sample does not tell of a floor; that of the run's means does, and stands beside it. */
function pairedTable(scene) {
  const pairs = report.paired.filter((pair) => pair.scene === scene.index && passes(report.cells[pair.cell]) && passes(report.cells[pair.against]));
  const missing = unpairedText(scene);
  if (pairs.length === 0 && missing === "") return null;
  const floors = pairs.some((pair) => pair.of_the_means);
  const headings = ["estimator", "against", "ratio for 1 sample, same streams", "interval if streams were independent",
    ...(floors ? [`ratio for ${pairs[0].samples} samples, bias included`] : [])];
  const rows = pairs.map((pair) => [
    markedLabel(report.cells[pair.cell].label), markedLabel(report.cells[pair.against].label), formatInterval(pair.ratio),
    formatEnds(pair.unpaired, (x) => formatNumber(x, 3)), ...(floors ? [pair.of_the_means ? formatInterval(pair.of_the_means) : ""] : [])]);
  return details("Mean squared errors on common random streams", pairs.length > 0 ? plainTable(headings, rows) : "", element("p", { className: "says" }, missing));
}

function showRanking(panel, scene) {
  const entries = scene.ranking.filter((entry) => passes(report.cells[entry.cell]));
  const table = element("table", { className: "ranking" }, headRow(rankingColumns.map(({ title }) => title)), element("tbody", {}, ...entries.map((entry) => rankingRow(scene, entry))));
  panel.append(element("div", {}, element("h4", {}, scene.short), inScroller(table), amortisedNote(entries), pairedTable(scene) ?? ""));
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

/** What a PASS proves, the reason of the others. */
function verdictReason(cell) {
  return cell.finding;
}

function sceneOfCell(cell) {
  return [cell.rays, cell.light, measurementOf(cell)].filter(Boolean).join(" · ");
}

const nanosecondsOf = (cell) => cell.time?.ns_per_sample?.value ?? null;
const firstOf = (key) => (cell) => cell[key][0] ?? null;

/** Columns of the table of every cell: how they are shown, and by what they are sorted. */
const cellColumns = [
  { title: "verdict", show: (cell) => element("td", {}, outcomeBadge(cell.marked_word, outcomeOf(cell), { title: verdictReason(cell) })), sort: outcomeOf },
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
  ...(anythingTimed ? [{ title: "ns a sample", show: single("ns_per_sample", nanosecondsOf), sort: nanosecondsOf }] : []),
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
  return `${cell.name} ${cell.label} ${cell.quantity} ${cell.light} ${cell.marked_word} ${verdictReason(cell)}`.toLowerCase();
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

/** Has the table of every cell show those of an outcome; set once the table is there. */
let chooseOutcome = () => {};

function cellTableControls(update) {
  const change = (key) => (value) => {
    cellTable[key] = value;
    cellTable.page = 0;
    update();
  };
  const outcomes = [...new Set(report.cells.map(outcomeOf))].sort();
  const choice = selectOf("Verdict", [["", "all"], ...outcomes.map((word) => [word, word])], change("outcome"));
  chooseOutcome = (word) => {
    choice.select.value = outcomes.includes(word) ? word : "";
    change("outcome")(choice.select.value);
  };
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
