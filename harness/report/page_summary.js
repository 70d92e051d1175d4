// Summary: what the runs are, how their verdicts end, who is fastest where.

function winnersOf(scene) {
  return scene.ranking.filter((entry) => entry.rank === 1 && passes(report.cells[entry.cell]));
}

/** The fastest of those that claim to be unbiased, with whom it is tied. */
function unbiasedWinnersOf(scene) {
  const entries = scene.ranking.filter((entry) => entry.rank !== null && passes(report.cells[entry.cell]) && standsUnbiased(report.cells[entry.cell]));
  const best = Math.min(...entries.map(({ rank }) => rank));
  return entries.filter(({ rank }) => rank === best);
}

/** Whoever is alone in a scene has won nothing. */
function hasRivals(scene) {
  return new Set(scene.ranking.map(({ cell }) => report.cells[cell]).filter(passes).map(({ estimator }) => estimator)).size > 1;
}

function claimTag(cell) {
  return cell.claims === "unbiased" || cell.claims === "exact" ? null : element("span", { className: "tag" }, cell.claims);
}

/** Several results of one tracker are no rivals: lists of entries, one for each tracker. */
function entriesByTracker(entries) {
  return [...groupedBy(entries, ({ cell }) => report.cells[cell].estimator).values()];
}

/** Tied trackers with " = " between them, results of one tracker with ", ". */
function namesAndSeconds(entries) {
  const joined = (between, lists) => lists.flatMap((list, i) => (i > 0 ? [between, ...list] : list));
  const nameOf = (entry) => [markedLabel(entry.label), claimTag(report.cells[entry.cell]) ?? ""];
  const timeOf = (entry) => {
    const time = secondsTo(report.cells[entry.cell], 0);
    return `${formatSeconds(time?.value)}${unprovenMark(time)}`;
  };
  const trackers = entriesByTracker(entries);
  const names = joined(" = ", trackers.map((own) => joined(", ", own.map(nameOf))));
  return [element("span", {}, ...names), trackers.map((own) => own.map(timeOf).join(", ")).join(" = ")];
}

function winnerRow(scene) {
  return [scene.short, ...namesAndSeconds(winnersOf(scene)), ...namesAndSeconds(unbiasedWinnersOf(scene))];
}

/** Results of a tracker count once; those that not all have this rank are named one by one. */
function tally(scenes, winners) {
  const wins = new Map();
  for (const scene of scenes)
    for (const name of new Set(winners(scene).map(({ cell, label, split }) => (split ? label : report.cells[cell].estimator)))) wins.set(name, (wins.get(name) ?? 0) + 1);
  return listed([...wins].sort((a, b) => b[1] - a[1]).map(([label, count]) => `${label} in ${countOf(count, "scene")}`), 2, "tracker");
}

function winnersSentence(scenes) {
  const unbiased = tally(scenes, unbiasedWinnersOf);
  const best = unbiased ? `; of those that claim to be unbiased: ${unbiased}` : "";
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
  if (report.tables.length === 0 && report.history === null && report.scenes.length <= 12) winners.open = true;
  if (report.credits.length > 0) winners.after(details("Volumes shown and their makers", element("ul", {}, ...report.credits.map((line) => element("li", {}, line)))));
  return () => {
    const scenes = report.scenes.filter((scene) => hasRivals(scene) && winnersOf(scene).length > 0);
    winners.hidden = scenes.length === 0;
    const named = scenes.flatMap((scene) => [...winnersOf(scene), ...unbiasedWinnersOf(scene)]);
    const hint = unprovenHint(named.map((entry) => secondsTo(report.cells[entry.cell], 0)));
    winners.replaceChildren(
      element("summary", {}, winnersSentence(scenes)), plainTable(["scene", "fastest to 1\u00a0% (= tied)", "seconds a ray", "fastest that claims to be unbiased", "seconds a ray"], scenes.map(winnerRow)),
      hint ? element("p", { className: "about" }, hint) : "");
  };
}
