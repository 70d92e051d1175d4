// The table of every cell: its columns, how it is sorted and filtered.

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
const nanosecondsAloneOf = (cell) => cell.time?.ns_per_sample_alone ?? null;
const firstOf = (key) => (cell) => cell[key][0] ?? null;

/** Columns of the table of every cell: how they are shown, and by what they are sorted. */
const cellColumns = [
  { title: "verdict", show: (cell) => element("td", {}, cellBadge(cell, { title: verdictReason(cell) })), sort: outcomeOf },
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
  ...(anythingTimed ? [
    { title: "ns a sample", show: single("ns_per_sample", nanosecondsOf), sort: nanosecondsOf },
    { title: "alone", show: single("ns_per_sample_alone", nanosecondsAloneOf), sort: nanosecondsAloneOf },
  ] : []),
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
const cellTable = { column: null, descending: false, page: 0, outcome: "", words: "", field: null, allRows: false };

function isOfField(cell, field) {
  return field === null || (cell.type === field.tracker && mediumType(cell) === field.medium);
}

function searchText(cell) {
  return `${cell.name} ${cell.label} ${cell.quantity} ${cell.light} ${cell.marked_word} ${verdictReason(cell)}`.toLowerCase();
}

function chosenCells() {
  const words = cellTable.words.toLowerCase().split(/\s+/);
  const chosen = passingCells().filter((cell) => isOfField(cell, cellTable.field) &&
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

/** Have the table of every cell show those of an outcome, or of a field of the matrix, and no others; set once the table is there. */
let chooseOutcome = () => {};
let chooseField = () => {};

function cellTableControls(update) {
  const outcomes = [...new Set(report.cells.map(outcomeOf))].sort();
  const change = (chosen) => {
    Object.assign(cellTable, chosen, { page: 0 });
    choice.select.value = cellTable.outcome;
    search.value = cellTable.words;
    field.hidden = cellTable.field === null;
    field.textContent = cellTable.field === null ? "" : `Only ${cellTable.field.tracker} on ${cellTable.field.medium}: show all`;
    update();
  };
  const choice = selectOf("Verdict", [["", "all"], ...outcomes.map((word) => [word, word])], (outcome) => change({ outcome }));
  const search = element("input", { type: "search", id: "search", oninput: () => change({ words: search.value }) });
  const field = button("", () => change({ field: null }), { hidden: true });
  chooseOutcome = (word) => change({ outcome: outcomes.includes(word) ? word : "", words: "", field: null });
  chooseField = (chosen) => change({ outcome: "", words: "", field: chosen });
  return element("div", { className: "controls" }, choice.label, element("label", { className: "choice" }, "Words in the name ", search), field);
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
