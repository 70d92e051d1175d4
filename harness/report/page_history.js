// Results of one configuration over time: what changed, and the figures of its cells as small series.

const sparkWidth = 110, sparkHeight = 26, sparkMargin = 4;

const historyFigures = [
  { key: "lookups", title: "lookups a sample", jumps: () => false },
  { key: "rmse", title: "rmse", jumps: () => false },
  { key: "variance", title: "variance", jumps: () => false },
  // Times of different machines or builds are no series.
  { key: "ns_per_sample", title: "ns a sample", jumps: (before, after) => before.cpu !== after.cpu || before.build !== after.build },
];

function drawing(tag, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** Points of a series in a small drawing; those without a number are left out. */
function sparkPoints(values) {
  const numbers = values.filter(isNumber);
  const low = Math.min(...numbers), high = Math.max(...numbers);
  const step = (sparkWidth - 2 * sparkMargin) / Math.max(1, values.length - 1);
  // A level series lies in the middle; changes below 1 % look small.
  const range = Math.max(high - low, 0.01 * Math.abs(high)) || 1;
  const middle = (low + high) / 2;
  return values.map((value, i) => isNumber(value) && {
    i, x: sparkMargin + i * step, y: sparkHeight / 2 - (sparkHeight - 2 * sparkMargin) * (value - middle) / range,
  }).filter(Boolean);
}

function spark(figure, values) {
  const points = sparkPoints(values);
  const text = `${figure.title}: ${values.map((value) => formatNumber(value, 3)).join(", ")}`;
  const box = drawing("svg", { class: "spark", width: sparkWidth, height: sparkHeight, role: "img", "aria-label": text }, drawing("title", {}));
  box.firstChild.textContent = text;
  points.forEach((point, at) => {
    const before = points[at - 1];
    if (before && !figure.jumps(report.history.results[before.i], report.history.results[point.i]))
      box.append(drawing("line", { x1: before.x, y1: before.y, x2: point.x, y2: point.y }));
  });
  for (const { x, y } of points) box.append(drawing("circle", { cx: x, cy: y, r: 2.5 }));
  return box;
}

/** The series, and its last number. */
function seriesCell(figure, cell) {
  const values = cell[figure.key];
  if (!values.some(isNumber)) return "";
  return element("span", { className: "series" }, spark(figure, values), " ", numberSpan(values[values.length - 1], (x) => formatNumber(x, 3)));
}

/** "PASS", or all words where they differ. */
function verdictSeries(words) {
  const known = words.map((word) => word ?? "none");
  return [...new Set(known)].length === 1 ? known[0] : known.join(" → ");
}

function seriesTable(cells) {
  const figures = historyFigures.filter(({ key }) => cells.some((cell) => cell[key].some(isNumber)));
  const table = plainTable(["cell", "verdict", ...figures.map(({ title }) => title)],
    cells.map((cell) => [breakable(cell.name), verdictSeries(cell.verdict), ...figures.map((figure) => seriesCell(figure, cell))]));
  table.firstChild.classList.add("history");
  return table;
}

function changesTable(changes) {
  const table = plainTable(["cell", "change", "before", "now", "note"], changes.map((one) => [breakable(one.cell), one.change, one.before, one.after, one.note]));
  table.firstChild.classList.add("history");
  return table;
}

function resultsTable({ results, steps }) {
  const rows = results.map((result, i) => {
    return [result.date, i === 0 ? unknown : steps[i - 1].says, result.verdicts, result.commit, result.cpu, result.file];
  });
  return plainTable(["result", "changed since the one before", "verdicts", "commit", "CPU", "file"], rows.reverse());
}

function buildHistory(body) {
  const history = report.history;
  const last = history.steps[history.steps.length - 1];
  const touched = new Set([...last.changes, ...last.undecided].map(({ cell }) => cell));
  const rest = numbersDetails(() => seriesTable(history.cells));
  rest.firstChild.textContent = `All ${countOf(history.cells.length, "cell")} over ${history.results.length} results`;
  body.append(
    element("p", { className: "meaning" }, history.says), last.changes.length > 0 ? changesTable(last.changes) : "",
    touched.size > 0 ? element("h3", {}, "The same cells over all results") : "", touched.size > 0 ? seriesTable(history.cells.filter(({ name }) => touched.has(name))) : "",
    last.undecided.length > 0 ? details(`May be chance: ${countOf(last.undecided.length, "difference")}`, changesTable(last.undecided)) : "",
    element("h3", {}, "Results"), resultsTable(history), ...[...last.notes, last.time].map((note) => element("p", { className: "about" }, note)), rest);
  return () => {};
}
