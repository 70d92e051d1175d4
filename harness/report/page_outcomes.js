// The words of verdicts: their badges, what they mean, how often each occurs.

const outcomeMarks = { PASS: "✓", FAIL: "✗", AGREE: "✓", DIFFER: "✗", VIOLATED: "!", INCONCLUSIVE: "?", "INCONCLUSIVE (as planned)": "?" };

const ownMeanMark = "(✓)";

/** The mark of a cell.  A PASS against the tracker's own mean rules out no bias. */
function markOf(cell) {
  return outcomeOf(cell) === "PASS" && cell.marks.includes("own mean") ? ownMeanMark : outcomeMarks[outcomeOf(cell)] ?? "";
}

function outcomeBadge(text, word = text, more = {}, mark = outcomeMarks[word]) {
  const kind = word.split(" ")[0].toLowerCase();
  return element(more.href ? "a" : "span", { className: `badge ${kind}`, ...more }, `${mark || "·"} ${text}`);
}

function cellBadge(cell, more = {}) {
  return outcomeBadge(cell.marked_word, outcomeOf(cell), more, markOf(cell));
}

const outcomeMeanings = {
  FAIL: "bias is proven, or lookups or walks break a law",
  AGREE: "the means of two trackers differ by less than twice epsilon; equal biases would not show",
  DIFFER: "the means of two trackers differ: one of them is biased",
  INCONCLUSIVE: "neither bias nor its absence is proven, though the plan foresaw a decision",
};

const decidedWords = ["PASS", "FAIL", "AGREE", "DIFFER"];

/** Why cells are open as planned, and how many of them another of the given results decides. */
function plannedText(cells) {
  const keyOf = (cell) => `${cell.scene} ${cell.name}`;
  const decided = new Set(report.cells.filter((cell) => decidedWords.includes(outcomeOf(cell))).map(keyOf));
  const elsewhere = cells.filter((cell) => decided.has(keyOf(cell))).length;
  const others = elsewhere > 0 ? `; with the samples of another of these results, ${elsewhere} of these cells ${elsewhere === 1 ? "is" : "are"} decided` : "";
  return `the plan said beforehand that no number of samples that the configuration allows decides${others}`;
}

/** The largest of each: trackers on the same streams see the same places, so a sum would count these twice. */
function violationsText(cells) {
  const lookups = Math.max(...cells.map((cell) => cell.violations));
  const largest = Math.max(...cells.map((cell) => cell.largest_violation ?? 1));
  return `needs a majorant that bounds the extinction: up to ${countOf(lookups, "lookup")} of a cell above the bound, the extinction at most ${formatNumber(largest, 3)} times the bound`;
}

/** "a bias above epsilon is ruled out (epsilon 0.37 % to 2 % of the mean)". */
function passText(cells) {
  const excluded = cells.map((cell) => cell.verdict?.excludes).filter(isNumber);
  if (excluded.length === 0) return "a bias above epsilon is ruled out";
  const shown = (x) => (x < rounding ? "rounding" : formatPercent(x));
  const [least, most] = [Math.min(...excluded), Math.max(...excluded)].map(shown);
  return `a bias above epsilon is ruled out (epsilon ${least === most ? most : `${least} to ${most}`} of the mean)`;
}

function outcomeMeaning(word, cells) {
  if (word === "PASS") return passText(cells);
  if (word === "INCONCLUSIVE (as planned)") return plannedText(cells);
  return word === "VIOLATED" ? violationsText(cells) : outcomeMeanings[word] ?? "see the reasons in the table of every cell";
}

/** What the marks of some cells mean, with their words; and why cells are not tested. */
function marksMeaning(cells) {
  const meanings = cellsByWord(cells).flatMap(([word, of]) => {
    if (word === "not tested") return [`${word}: ${listed([...new Set(of.map((cell) => cell.finding))], 2, "reason")}`];
    const own = of.filter((cell) => markOf(cell) === ownMeanMark), others = of.filter((cell) => !own.includes(cell));
    const plain = others.length > 0 ? [`${outcomeMarks[word] ?? ""} ${word}: ${outcomeMeaning(word, others)}`.trim()] : [];
    return own.length > 0 ? [...plain, `${ownMeanMark} PASS (own mean): the mean is the one that the tracker's theory predicts, which may be biased`] : plain;
  });
  return meanings.join("; ");
}

const verdictWords = ["PASS", "FAIL", "AGREE", "DIFFER", "VIOLATED", "INCONCLUSIVE", "INCONCLUSIVE (as planned)", "ERROR", "not run", "not tested"];

/** How many cells of a word have each mark: "(of them 3 by pilot, 1 own mean)". */
function marksText(cells) {
  const counts = new Map();
  for (const mark of cells.flatMap((cell) => cell.marks)) counts.set(mark, (counts.get(mark) ?? 0) + 1);
  return counts.size === 0 ? "" : element("small", {}, `(of them ${[...counts].map(([mark, count]) => `${count} ${mark}`).join(", ")}) `);
}

/** The cells of each word that occurs: [["PASS", [...]], ...]. */
function cellsByWord(cells) {
  return verdictWords.map((word) => [word, cells.filter((cell) => outcomeOf(cell) === word)]).filter(([, of]) => of.length > 0);
}

function verdictTotals() {
  const badges = cellsByWord(report.cells).flatMap(([word, of]) =>
    [outcomeBadge(`${of.length} ${word}`, word, { href: "#verdicts", title: marksMeaning(of), onclick: () => chooseOutcome(word) }), marksText(of)]);
  return element("p", { className: "totals" }, ...badges);
}
