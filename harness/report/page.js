// The sections in their order, and what happens when filters, theme, width or paper change.

const sections = [
  { id: "summary", title: "Summary", says: "How many trackers keep their claims, and which one is fastest where.", present: () => true, build: buildSummary },
  { id: "history", title: "History", says: "What changed from result to result, as far as chance cannot have changed it.", present: () => report.history !== null, build: buildHistory },
  { id: "outcomes", title: "Verdicts", says: "Which tracker keeps its claims on which medium; a field leads to its cells.", present: () => report.scenes.length > manyScenes && report.cells.some((cell) => cell.verdict), build: buildVerdictMatrix },
  { id: "tables", title: "Tables", says: "Do the figures that someone published come out again, and where they do not, what makes the difference?", present: () => report.tables.length > 0, build: buildTables },
  { id: "claims", title: "Claims", says: "Does what was published hold? A refuted claim is a result; what cannot be told needs more samples, or a scene that is not here.", present: () => report.claims.length > 0, build: buildClaims },
  { id: "times", title: "Time to 1\u00a0%", says: "How long each tracker takes on one thread until the error of one ray is 1\u00a0% of the root mean square of the reference. Bars are 95\u00a0% intervals.", present: () => report.cells.some(reachesTheError), build: buildTimes },
  { id: "ranking", title: "Ranking", says: "Which tracker reaches an error soonest. A rank is 1 plus the number of trackers that are proven faster, by all of their results; = marks equal ranks. Brackets are 95 % intervals.", present: () => report.cells.some((cell) => cell.cost), build: buildRanking },
  { id: "error", title: "Error", says: "How the error falls with work: parallel to the dotted line where it is noise alone, level where bias is left.", present: () => usefulConvergenceViews().length > 0, build: buildError },
  { id: "pareto", title: "Pareto front", says: "Which trackers no other beats in both variance and time of a sample, by all of its results.", present: () => report.cells.some(hasParetoPoint), build: buildPareto },
  { id: "matrix", title: "Efficiency matrix", says: "What each tracker costs in each scene; 1 is the best unbiased one of the scene.", present: () => usefulMatrixViews().length > 0, build: buildMatrix },
  { id: "maps", title: "Maps of cost", says: "Where in the picture variance and lookups are spent.", present: () => report.cells.some(hasImages), build: buildMaps },
  { id: "strips", title: "Pictures", says: "What each tracker shows beside the truth: the reference, its estimate, and the error with its sign.", present: () => report.cells.some(hasImages), build: buildStrips },
  { id: "scaling", title: "Scaling", says: "How cost grows with what is swept; the exponent p is that of cost ~ x^p.", present: () => usefulScalingViews().length > 0, build: buildScaling },
  { id: "verdicts", title: "Every cell", says: "What was measured, and whether it proves the tracker unbiased to within epsilon.", present: () => report.cells.length > 0, build: buildVerdicts },
  { id: "reproduce", title: "Reproduce", says: "The commands that give these numbers, and what they ran on.", present: () => true, build: buildReproduce },
];

const updates = new Map();

function updateAll() {
  tellFiltered();
  for (const update of updates.values()) update();
}

/** One scene is chosen for all sections that show one at a time. */
function chooseScene(index) {
  chosenScene = index;
  for (const id of ["times", "ranking", "error", "pareto", "maps", "strips"]) updates.get(id)?.();
}

function mount({ id, title, says, build }) {
  const heading = element("h2", { id: `${id}-heading` }, id === "summary" ? report.title : title);
  const body = element("div", {});
  const section = element("section", { id, "aria-labelledby": heading.id }, heading, element("p", { className: "says" }, says), body);
  document.getElementById("content").append(section);
  document.getElementById("contents").append(element("li", {}, element("a", { href: `#${id}` }, title)));
  updates.set(id, build(body));
}

/** Paper shows all rows, all details and all plots, in light colours. */
function followPaper() {
  let before = null;
  addEventListener("beforeprint", () => {
    before = { theme: document.documentElement.dataset.theme, closed: [...document.querySelectorAll("main details:not([open]):not(.numbers)")] };
    cellTable.allRows = true;
    updates.get("verdicts")?.();
    for (const one of before.closed) one.open = true;
    document.documentElement.dataset.theme = "light";
    document.documentElement.dataset.paper = "";
    drawAllFigures();
  });
  addEventListener("afterprint", () => {
    cellTable.allRows = false;
    updates.get("verdicts")?.();
    for (const one of before.closed) one.open = false;
    delete document.documentElement.dataset.paper;
    setTheme(before.theme);
  });
}

function followHash() {
  const target = document.getElementById(location.hash.slice(1));
  if (target) target.scrollIntoView();
}

function start() {
  document.title = `${report.title} – nullmark`;
  for (const section of sections) if (section.present()) mount(section);
  buildFilters(updateAll);
  updateAll();
  followTheme();
  followWidth();
  followPaper();
  followHash();
  document.documentElement.dataset.ready = "page";
  if (new URLSearchParams(location.search).has("figures")) writeFigures();
}
start();
