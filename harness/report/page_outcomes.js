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
  PASS: "a bias above epsilon is ruled out",
  FAIL: "bias is proven, or lookups or walks break a law",
  AGREE: "the means of two trackers differ by less than twice epsilon; equal biases would not show",
  DIFFER: "the means of two trackers differ: one of them is biased",
  INCONCLUSIVE: "neither bias nor its absence is proven, though the plan foresaw a decision",
  "INCONCLUSIVE (as planned)": "the plan said beforehand that no affordable number of samples decides",
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

/** What the marks of some cells mean, with their words; and why cells are not tested. */
function marksMeaning(cells) {
  const meanings = cellsByWord(cells).flatMap(([word, of]) => {
    if (word === "not tested") return [`${word}: ${listed([...new Set(of.map((cell) => cell.finding))], 2)}`];
    const own = of.filter((cell) => markOf(cell) === ownMeanMark);
    const plain = own.length < of.length ? [`${outcomeMarks[word] ?? ""} ${word}: ${outcomeMeaning(word)}`.trim()] : [];
    return own.length > 0 ? [...plain, `${ownMeanMark} PASS (own mean): the mean is the one that the tracker's theory predicts, which may be biased`] : plain;
  });
  return meanings.join("; ");
}

const verdictWords = ["PASS", "FAIL", "AGREE", "DIFFER", "VIOLATED", "INCONCLUSIVE", "INCONCLUSIVE (as planned)", "ERROR", "not run", "not tested"];

/** How many cells of a word have each mark: "(3 by pilot, 1 own mean)". */
function marksText(cells) {
  const counts = new Map();
  for (const mark of cells.flatMap((cell) => cell.marks)) counts.set(mark, (counts.get(mark) ?? 0) + 1);
  return counts.size === 0 ? "" : element("small", {}, `(${[...counts].map(([mark, count]) => `${count} ${mark}`).join(", ")}) `);
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
