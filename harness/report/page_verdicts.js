// The verdicts of a sweep at one look: trackers down, media across, in each field a bar for every experiment.

const manyScenes = 12;

/** "channels" of "channels(cosine/...)". */
function mediumType(cell) {
  return cell.medium.split(/[/(]/)[0];
}

/** Lists of cells by what `keyOf` says of each, in the order in which the keys first occur. */
function groupedBy(cells, keyOf) {
  const groups = new Map();
  for (const cell of cells) {
    const key = keyOf(cell);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(cell);
  }
  return groups;
}

/** How many cells have each word: [["PASS", 3], ...]. */
function wordCounts(cells) {
  return cellsByWord(cells).map(([word, of]) => [word, of.length]);
}

function countsText(cells) {
  return wordCounts(cells).map(([word, count]) => `${count} ${word}`).join(", ");
}

function outcomeClass(word) {
  return word === "INCONCLUSIVE (as planned)" ? "planned" : word.split(" ")[0].toLowerCase();
}

/** The words of some cells, each as long as its share. */
function shareBar(cells) {
  return element("span", { className: "share" }, ...wordCounts(cells).map(([word, count]) => {
    const part = element("span", { className: outcomeClass(word) });
    part.style.flexGrow = String(count);
    return part;
  }));
}

function fieldOf(tracker, medium, cells, experiments) {
  if (cells.length === 0) return "";
  const by = groupedBy(cells, (cell) => cell.experiment);
  const lines = experiments.filter((name) => by.has(name)).map((name) => `${name}: ${countsText(by.get(name))}`);
  const bars = experiments.map((name) => (by.has(name) ? shareBar(by.get(name)) : element("span", { className: "share" })));
  return element("a", {
    className: "field", href: "#verdicts", title: [`${tracker} on ${medium}`, ...lines].join("\n"), "aria-label": `${tracker} on ${medium}: ${countsText(cells)}`,
    onclick: () => chooseField({ tracker, medium }),
  }, ...bars);
}

function verdictKey(cells) {
  return element("p", { className: "keys" }, ...wordCounts(cells).map(([word]) =>
    element("span", { className: "key" }, element("span", { className: "share" }, element("span", { className: outcomeClass(word) })), ` ${word}`)));
}

/** PASS count, and counts of words that need attention. */
function shortCounts(cells) {
  const counts = new Map(wordCounts(cells));
  const told = ["FAIL", "DIFFER", "ERROR", "INCONCLUSIVE", "VIOLATED"].filter((word) => counts.has(word));
  const passed = `${counts.get("PASS") ?? 0} of ${cells.length} PASS`;
  return element("span", { title: countsText(cells) }, [passed, ...told.map((word) => `${counts.get(word)} ${word}`)].join(", "));
}

function buildVerdictMatrix(body) {
  const panel = element("div", {});
  body.append(panel);
  return () => {
    const cells = passingCells();
    const experimentsOf = (some) => [...groupedBy(some, ({ experiment }) => experiment).keys()];
    const media = [...groupedBy(cells, mediumType)].map(([medium, own]) => ({ medium, own, experiments: experimentsOf(own) }));
    const rows = [...groupedBy(cells, ({ type }) => type)].sort(([a], [b]) => (a < b ? -1 : 1)).map(([tracker, own]) => {
      const on = groupedBy(own, mediumType);
      const fields = media.map(({ medium, experiments }) => fieldOf(tracker, medium, on.get(medium) ?? [], experiments));
      return [element("th", { scope: "row" }, tracker), shortCounts(own), ...fields];
    });
    const heads = media.map(({ medium, own }) => element("span", {}, medium, element("small", { className: "aside" }, shortCounts(own))));
    const table = plainTable(["tracker", "verdicts", ...heads], rows);
    table.classList.add("verdict-matrix");
    const order = media.map(({ medium, experiments }) => element("li", {}, `${medium}: ${experiments.join(", ")}`));
    panel.replaceChildren(verdictKey(cells), table, details("The bars of a field are experiments, from left to right", element("ul", {}, ...order)));
  };
}
