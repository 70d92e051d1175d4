// Rankings: who reaches an error soonest, and the same on common random streams.

function rankText(entry) {
  if (entry.rank === null) return unknown;
  return entry.tied ? `${entry.rank}=` : String(entry.rank);
}

function reachedText(cell, place) {
  const target = secondsTo(cell, place);
  if (!target || !cell.time?.ns_per_sample) return unknown;
  if (!target.reached) return "never";
  return element("span", {}, target.amortised ? "~" : "", intervalText(target, formatSeconds, unprovenMark(target)));
}

function breakEvenText(scene, place) {
  const entry = scene.break_even.find(({ cell }) => cell === place);
  if (!entry) return "";
  if (entry.kind !== "at") return entry.kind;
  return `${formatSeconds(entry.seconds?.value)}, at ${formatPercent(entry.error?.value)}${unprovenMark(entry)}`;
}

function estimatorCell(scene, entry, cell) {
  const baseline = entry.cell === scene.baseline ? element("span", { className: "tag" }, "baseline") : "";
  return element("span", {}, markedLabel(entry.label), baseline, claimTag(cell) ?? "");
}

/** Columns of a ranking; those of times are left out where nothing was timed, and those without content. */
const rankingColumns = [
  { title: "rank", timed: true, of: (_, entry) => rankText(entry) },
  { title: "estimator", of: estimatorCell },
  { title: "verdict", of: (_, __, cell) => cellBadge(cell, { title: verdictReason(cell) }) },
  { title: "cost relative to baseline", timed: true, of: (_, entry) => intervalText(entry.relative) },
  { title: "seconds to\u00a01\u00a0%", timed: true, of: (_, __, cell) => reachedText(cell, 0) },
  { title: "seconds to\u00a00.1\u00a0%", timed: true, of: (_, __, cell) => reachedText(cell, 1) },
  { title: "variance", of: (_, __, cell) => intervalText(cell.cost?.variance) },
  { title: "variance × ns", timed: true, of: (_, __, cell) => intervalText(cell.cost?.variance_x_ns) },
  { title: "variance × ns, alone", timed: true, of: (_, __, cell) => intervalText(cell.cost?.variance_x_ns_alone) },
  { title: "variance × lookups", of: (_, __, cell) => intervalText(cell.cost?.variance_x_lookups) },
  { title: "floor of the error", of: (_, __, cell) => (floorText(cell) ? intervalText(cell.cost.floor, formatPercent) : "") },
  { title: "cheaper than the best unbiased until", timed: true, of: (scene, entry) => breakEvenText(scene, entry.cell) },
].filter(({ timed }) => anythingTimed || !timed);

function hasContent(shown) {
  const text = shown instanceof Node ? shown.textContent : shown;
  return text !== "" && text !== unknown;
}

/** Rows of the table, without columns that are empty in all rows. */
function rankingRows(scene, entries) {
  const rows = entries.map((entry) => rankingColumns.map(({ of }) => of(scene, entry, report.cells[entry.cell])));
  const kept = rankingColumns.map((_, column) => column).filter((column) => rows.some((row) => hasContent(row[column])));
  const made = rows.map((row, place) => {
    const line = tableRow(kept.map((column) => row[column]));
    line.dataset.ranked = String(entries[place].cell);
    return line;
  });
  return { titles: kept.map((column) => rankingColumns[column].title), rows: made };
}

function amortisedNote(entries) {
  const some = entries.some((entry) => report.cells[entry.cell].cost?.seconds.some(({ amortised }) => amortised));
  return some ? element("p", { className: "says" }, "~ fewer samples are needed than shared a walk through the majorant structure when they were timed.") : "";
}

function unprovenNote(scene) {
  return anythingTimed && scene.unproven ? element("p", { className: "says" }, `* ${scene.unproven}.`) : "";
}

/** Ranks of one tracker that differ: what is said of one of its results does not hold of all. */
function splitNote(entries) {
  const some = new Set(entries.filter(({ split }) => split).map(({ cell }) => report.cells[cell].estimator));
  return some.size > 0 ? element("p", { className: "says" }, `Results of ${listed([...some])} have different ranks. A tracker is faster than another only if all of its results are.`) : "";
}

function sameTrackerNote(scene, entries) {
  const base = scene.ranking.find(({ cell }) => cell === scene.baseline);
  const some = base && base.rank !== null && entries.some(({ rank, relative }) => rank !== null && relative === null);
  return some ? element("p", { className: "says" }, `${unknown} under cost relative to baseline: another result of the baseline's tracker, which is no rival.`) : "";
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
  const { titles, rows } = rankingRows(scene, entries);
  const table = element("table", { className: "ranking" }, headRow(titles), element("tbody", {}, ...rows));
  panel.append(element("div", {}, element("h4", {}, scene.short), inScroller(table), amortisedNote(entries), unprovenNote(scene), splitNote(entries), sameTrackerNote(scene, entries), pairedTable(scene) ?? ""));
}

function buildRanking(body) {
  const update = scenePanels(body, (cell) => cell.cost !== null, showRanking);
  body.querySelector(".panels").classList.add("stacked");
  return update;
}
