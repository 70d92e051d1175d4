"use strict";

// The page: filters, sections and when plots are drawn.

const data = JSON.parse(document.getElementById("data").textContent);
const kFacets = [["estimator", "Estimators"], ["medium", "Media"], ["quantity", "Quantities"]];

/// What the reader chose.
const chosen = {
  hidden: {estimator: new Set(), medium: new Set(), quantity: new Set()},
  scene: 0, error: "time", matrix: "variance_x_ns", axis: null, scaling: "ns_per_sample",
  verdicts: {column: null, ascending: true, first: 0, outcome: ""},
};

const visible = (cell) => kFacets.every(([facet]) => !chosen.hidden[facet].has(cell[facet]));
const visibleCells = () => new Set(data.cells.flatMap((cell, i) => (visible(cell) ? [i] : [])));
const visibleScenes = () => data.scenes.flatMap((scene, s) => (scene.ranking.some((row) => visible(data.cells[row.cell])) ? [s] : []));

function sceneCells(s) {
  return s === undefined ? [] : data.scenes[s].ranking.map((row) => data.cells[row.cell]).filter(visible);
}

/// The chosen scene, or the first that the filters leave.
function currentScene() {
  const scenes = visibleScenes();
  return scenes.includes(chosen.scene) ? chosen.scene : scenes[0];
}

// Plots are drawn when they come into sight, and again when what they show has changed.

const figures = [];
const inSight = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    const figure = figures.find(({place}) => place === entry.target);
    figure.near = entry.isIntersecting;
    if (figure.near && figure.stale) draw(figure);
  }
}, {rootMargin: "300px"});

function themeLayout(paper = false) {
  const style = getComputedStyle(document.documentElement);
  const colour = (name, light) => (paper ? light : style.getPropertyValue(name).trim());
  const ink = colour("--ink", "#1a1c20"), line = colour("--line", "#c9ced6"), background = colour("--paper", "#ffffff");
  const axis = {gridcolor: line, linecolor: line, zerolinecolor: line};
  return {paper_bgcolor: background, plot_bgcolor: background, font: {color: ink, size: 12}, axis};
}

/// Layout of a plot in the page's colours; all its axes have them.
function themed(layout, paper) {
  const {axis, ...base} = themeLayout(paper);
  const result = {margin: {l: 70, r: 20, t: 20, b: 60}, legend: {orientation: "v"}, hovermode: "closest", ...base, ...layout};
  for (const name of Object.keys(result)) if (/^[xy]axis\d*$/.test(name)) result[name] = {...axis, ...result[name]};
  return result;
}

function draw(figure) {
  figure.stale = false;
  const plot = figure.make();
  figure.numbers.replaceChildren();
  figure.element.hidden = plot.data.length === 0;
  if (plot.data.length === 0) return;
  const {heads, rows} = plot.numbers;
  figure.fill = () => figure.numbers.replaceChildren(table(heads, rows.slice(0, 2000).map((row) => element("tr", {}, ...row.map((value, i) => (Array.isArray(heads[i]) ? textCell(value) : numberCell(value)))))));
  if (figure.details.open) figure.fill();
  Plotly.react(figure.place, plot.data, themed(plot.layout), {responsive: true, displaylogo: false});
}

/// A place for a plot; `make` gives its traces, layout and numbers.
function plotFigure(name, caption, make) {
  const place = element("div", {class: "plot", "data-plot": name, role: "img", "aria-label": caption});
  const numbers = element("div");
  const details = element("details", {}, element("summary", {}, "Numbers"), numbers);
  const figure = {place, numbers, details, make, stale: true, near: false, fill: () => {}};
  figure.element = element("figure", {}, place, element("figcaption", {}, caption), details);
  details.addEventListener("toggle", () => { if (details.open) figure.fill(); });
  figures.push(figure);
  inSight.observe(place);
  return figure.element;
}

function redraw() {
  for (const figure of figures) {
    figure.stale = true;
    if (figure.near) draw(figure);
  }
}

// Controls.

function picker(label, options, value, choose) {
  const select = element("select", {on: {change: () => choose(select.value)}});
  for (const [key, text] of options) select.append(element("option", {value: key, selected: key === value}, text));
  return element("label", {class: "controls"}, `${label} `, select);
}

function facetFilter([facet, title]) {
  const values = [...new Set(data.cells.map((cell) => cell[facet]))].sort();
  const choices = element("div", {class: "choices"});
  const boxes = values.map((value) => element("input", {type: "checkbox", checked: true, "data-facet": facet, "data-value": value, on: {
    change: (event) => {
      chosen.hidden[facet][event.target.checked ? "delete" : "add"](value);
      refresh();
    },
  }}));
  const all = (on) => element("button", {type: "button", on: {
    click: () => {
      boxes.forEach((box, i) => {
        box.checked = on;
        chosen.hidden[facet][on ? "delete" : "add"](values[i]);
      });
      refresh();
    },
  }}, on ? "all" : "none");
  choices.append(all(true), " ", all(false), ...boxes.map((box, i) => element("label", {}, box, ` ${values[i]}`)));
  return element("details", {"data-filter": facet}, element("summary", {}, `${title} (${values.length})`), choices);
}

let sceneSelect = null;

function fillSceneSelect() {
  const scenes = visibleScenes(), current = currentScene();
  sceneSelect.replaceChildren(...scenes.map((s) => element("option", {value: s, selected: s === current}, sceneLabel(data.scenes[s].name))));
}

function themeButton() {
  const root = document.documentElement, preferred = matchMedia("(prefers-color-scheme: dark)");
  const button = element("button", {type: "button", id: "theme"});
  const apply = (dark) => {
    root.dataset.theme = dark ? "dark" : "light";
    button.textContent = dark ? "Light" : "Dark";
    button.setAttribute("aria-label", dark ? "Light colours" : "Dark colours");
    redraw();
  };
  button.addEventListener("click", () => apply(root.dataset.theme !== "dark"));
  preferred.addEventListener("change", (event) => apply(event.matches));
  apply(preferred.matches);
  return button;
}

function buildFilters() {
  const form = document.getElementById("filters");
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("keydown", (event) => {
    if (event.key === "Escape") form.querySelectorAll("details[open]").forEach((details) => { details.open = false; details.querySelector("summary").focus(); });
  });
  form.append(...kFacets.map(facetFilter));
  if (data.scenes.length > 0) {
    sceneSelect = element("select", {id: "scene", on: {change: () => { chosen.scene = Number(sceneSelect.value); refresh(); }}});
    form.append(element("label", {}, "Scene ", sceneSelect));
  }
  form.append(themeButton());
}

// Sections.

const kVerdictWords = {pass: "PASS", fail: "FAIL", expected_open: "INCONCLUSIVE as planned", unexpected_open: "INCONCLUSIVE", violated: "VIOLATED", errors: "ERROR", not_run: "not run", unclaimed: "nothing claimed"};

function totals(run) {
  return element("ul", {class: "totals"}, ...Object.entries(kVerdictWords).filter(([key]) => run.verdicts[key] > 0)
    .map(([key, word]) => element("li", {class: word.split(" ")[0]}, `${run.verdicts[key]} ${word}`)));
}

/// Of those that vary: a closed form or an exact traversal wins where there is one, and is no tracker.
const isUnbiased = (cell) => cell.claims === "unbiased" && cell.cost && !cell.cost.floor;

/// Who is fastest to 1 % in a scene; all that tie.
function leaders(scene) {
  const rows = scene.ranking.filter((row) => visible(data.cells[row.cell]) && row.rank !== null);
  const of = (unbiased) => {
    const kept = rows.filter((row) => !unbiased || isUnbiased(data.cells[row.cell]));
    return kept.filter((row) => row.rank === kept[0].rank);
  };
  return [of(false), of(true)];
}

function leaderCell(rows) {
  if (rows.length === 0) return textCell("–");
  const seconds = data.cells[rows[0].cell].cost.seconds[0];
  return textCell(`${rows.map((row) => row.label).join(" = ")} (${intervalText(seconds)} s)`);
}

const kMostLeaders = 60;

function drawSummary(section) {
  section.append(...data.runs.map(totals));
  const ranked = visibleScenes().map((s) => data.scenes[s]).filter((scene) => scene.ranking.some((row) => row.rank !== null));
  if (ranked.length > 0)
    section.append(table([["scene"], ["fastest to 1 %"], ["fastest unbiased to 1 %"]], ranked.slice(0, kMostLeaders).map((scene) => {
      const [all, unbiased] = leaders(scene);
      return element("tr", {}, textCell(sceneLabel(scene.name)), leaderCell(all), leaderCell(unbiased));
    })));
  if (ranked.length > kMostLeaders) section.append(element("p", {}, `${ranked.length - kMostLeaders} more scenes: the filters choose among them.`));
  for (const line of data.credits) section.append(element("p", {class: "credit"}, `Volume ${line}`));
}

/// A number of a configuration's table, and the picture that it sums up.
function answeredCell(value, at) {
  const cell = numberCell(value, undefined, {class: "answered"});
  const images = at !== null && data.cells[at].images;
  if (images && images.mean !== undefined) cell.append(thumbnail(data.images[images.mean], `${data.cells[at].experiment}, ${data.cells[at].estimator}: estimate`));
  return cell;
}

function drawTables(section) {
  for (const one of data.tables) {
    const note = one.rows.some((row) => row.note);
    section.append(element("h3", {}, `${one.title} (${one.metric})`));
    section.append(table([[""], ...one.columns, ...(note ? [["note"]] : [])], one.rows.map((row) =>
      element("tr", {}, textCell(row.label), ...row.values.map((value, i) => answeredCell(value, row.cells[i])), ...(note ? [textCell(row.note)] : []))), {class: "configured"}));
  }
}

function floorText(floor) {
  if (!floor || floor.high === 0) return "";
  return floor.low > 0 ? percent(floor.value) : `< ${percent(floor.high)}`;
}

function breakEvenText(entry) {
  if (!entry) return "";
  return entry.kind === "at" ? `${intervalText(entry.seconds)} s, at ${percent(entry.error.value)}` : entry.kind;
}

function secondsCell(cell, target) {
  const seconds = cell.cost && cell.cost.seconds[target];
  if (!seconds) return numberCell(null);
  return seconds.value === null && cell.time ? numberCell(null, "never") : intervalCell(seconds);
}

function rankingRow(row, scene) {
  const cell = data.cells[row.cell], cost = cell.cost || {};
  return element("tr", {"data-cell": row.cell}, numberCell(row.rank, row.rank === null ? "–" : `${row.rank}${row.tied ? "=" : ""}`), textCell(row.label), intervalCell(cost.variance), intervalCell(cost.variance_x_lookups),
    intervalCell(cost.variance_x_ns), secondsCell(cell, 0), secondsCell(cell, 1), intervalCell(row.relative), numberCell(cost.floor ? cost.floor.value : null, floorText(cost.floor)),
    textCell(breakEvenText(scene.break_even.find((entry) => entry.cell === row.cell))));
}

function drawRanking(section) {
  const s = currentScene();
  if (s === undefined) return;
  const scene = data.scenes[s];
  section.append(element("p", {}, scene.name));
  section.append(table(["rank", ["estimator"], "variance", "variance × lookups", "variance × ns", "s to 1 %", "s to 0.1 %", scene.baseline === null ? "/ baseline" : `/ ${data.cells[scene.baseline].estimator}`, "floor", ["cheaper than the best unbiased until"]],
    scene.ranking.filter((row) => visible(data.cells[row.cell])).map((row) => rankingRow(row, scene)), {id: "ranking-table"}));
  const pairs = data.paired.filter((pair) => pair.scene === s && visible(data.cells[pair.cell]));
  if (pairs.length === 0) return;
  section.append(element("details", {}, element("summary", {}, "On common random streams"),
    table([["estimator"], `mean squared error / that of ${data.cells[pairs[0].against].estimator}`, "as if the streams were others"],
      pairs.map((pair) => element("tr", {}, textCell(data.cells[pair.cell].estimator), intervalCell(pair.ratio), intervalCell(pair.unpaired))))));
}

function drawError(section) {
  section.append(picker("Show", Object.entries(kErrorModes).map(([key, kind]) => [key, kind.text]), chosen.error, (mode) => { chosen.error = mode; redraw(); }));
  section.append(plotFigure("error", "Measured points with 95 % intervals; grey: the slope that independent samples have; dotted: floors of biased trackers. Exact estimators are left out.", () => errorPlot(sceneCells(currentScene()), chosen.error)));
}

function drawPareto(section) {
  section.append(plotFigure("pareto", "Variance of one sample over its time; ringed: none is better in both.", () => paretoPlot(sceneCells(currentScene()))));
}

function drawMatrix(section) {
  section.append(picker("Show", Object.entries(kMatrixModes).map(([key, kind]) => [key, kind.text]), chosen.matrix, (mode) => { chosen.matrix = mode; redraw(); }));
  section.append(plotFigure("matrix", "Times the best of the scene; bright is better. Numbers lists the scenes.", () => matrixPlot(data, visibleCells(), chosen.matrix)));
}

/// Cells with pictures: of the chosen scene where it has any, with those of like scenes that only the measurement sets apart.
function picturedCells() {
  const s = currentScene();
  if (s === undefined) return [];
  const {medium, majorant, quantity} = data.scenes[s];
  const like = data.cells.filter((cell) => visible(cell) && cell.images && cell.medium === medium && cell.majorant === majorant && cell.quantity === quantity);
  return like.length > 0 ? like.slice(0, 24) : data.cells.filter((cell) => visible(cell) && cell.images).slice(0, 24);
}

function drawMaps(section) {
  section.append(plotFigure("maps", "One line a tracker, one scale a column, cut at the 99th percentile; variances over four decades.", () => pictureGrid(data, picturedCells(), kMapColumns)));
}

function drawStrips(section) {
  section.append(plotFigure("strips", "Reference and estimate from 0, black, to 1, white; signed error: estimate minus reference.", () => pictureGrid(data, picturedCells(), kStripColumns)));
}

function visibleSeries() {
  return data.scaling.filter((series) => series.points.every((point) => visible(data.cells[point.cell])));
}

function drawScaling(section) {
  const axes = [...new Set(data.scaling.map((series) => series.axis))].sort();
  if (!axes.includes(chosen.axis)) chosen.axis = axes[0];
  section.append(picker("Parameter", axes.map((axis) => [axis, axis]), chosen.axis, (axis) => { chosen.axis = axis; redraw(); }));
  section.append(picker("Show", Object.entries(kScalingModes).map(([key, kind]) => [key, kind.text]), chosen.scaling, (mode) => { chosen.scaling = mode; redraw(); }));
  section.append(plotFigure("scaling", "Cost against one parameter, all else the same; in brackets the fitted exponent.", () => scalingPlot(visibleSeries().slice(0, 60), chosen.axis, chosen.scaling)));
}

function outcome(cell) {
  if (cell.status === "error") return "ERROR";
  if (cell.status !== "ok") return cell.status.replace("_", " ");
  return cell.verdict && cell.verdict.outcome ? cell.verdict.outcome : "–";
}

const worst = (list, magnitude) => list.reduce((most, x) => (x !== null && (most === null || magnitude(x) > magnitude(most)) ? x : most), null);

const kVerdictColumns = [
  {head: "cell", text: true, value: (cell) => cell.name},
  {head: "verdict", text: true, value: outcome},
  {head: "mean", value: (cell) => cell.mean[0] ?? null},
  {head: "reference", value: (cell) => cell.reference[0] ?? null},
  {head: "bias", value: (cell) => worst(cell.bias, Math.abs)},
  {head: "RMSE", value: (cell) => cell.rmse[0] ?? null},
  {head: "variance", value: (cell) => cell.variance[0] ?? null},
  {head: "lookups", value: (cell) => cell.lookups},
  {head: "ns a sample", value: (cell) => (cell.time && cell.time.ns_per_sample ? cell.time.ns_per_sample.value : null)},
  {head: "epsilon", value: (cell) => (cell.verdict ? cell.verdict.epsilon : null)},
  {head: "samples a ray", value: (cell) => (cell.verdict ? cell.verdict.samples_per_ray : cell.samples_per_ray)},
  {head: "reason", text: true, value: (cell) => cell.reason || (cell.verdict ? cell.verdict.reason : "")},
];
const kVerdictPage = 200;

function sortedCells() {
  const {column, ascending, outcome: wanted} = chosen.verdicts;
  const cells = data.cells.flatMap((cell, i) => (visible(cell) && (!wanted || outcome(cell) === wanted) ? [i] : []));
  if (column === null) return cells;
  const value = (i) => kVerdictColumns[column].value(data.cells[i]);
  const order = (a, b) => (a === null ? 1 : b === null ? -1 : a < b ? -1 : a > b ? 1 : 0);
  return cells.sort((a, b) => (ascending || value(a) === null || value(b) === null ? order(value(a), value(b)) : order(value(b), value(a))));
}

function verdictRow(i) {
  const cell = data.cells[i];
  return element("tr", {"data-cell": i}, ...kVerdictColumns.map(({head, text, value}) => (text ? textCell(value(cell), {class: `text ${head === "verdict" ? outcome(cell).split(" ")[0] : ""}`}) : numberCell(value(cell), undefined, {"data-column": head}))));
}

function verdictHead(section) {
  return element("tr", {}, ...kVerdictColumns.map(({head, text}, c) => {
    const state = chosen.verdicts, sorted = state.column === c;
    const sort = () => {
      Object.assign(state, {column: c, ascending: sorted ? !state.ascending : true, first: 0});
      again(section);
      section.querySelectorAll("th button")[c].focus();
    };
    return element("th", {scope: "col", class: text ? "text" : "", "aria-sort": sorted ? (state.ascending ? "ascending" : "descending") : "none"}, element("button", {type: "button", on: {click: sort}}, head));
  }));
}

function drawVerdicts(section) {
  const state = chosen.verdicts, cells = sortedCells();
  if (state.first >= cells.length) state.first = 0;
  const last = Math.min(cells.length, state.first + kVerdictPage);
  const turn = (by, text) => element("button", {type: "button", disabled: state.first + by < 0 || state.first + by >= cells.length, on: {click: () => { state.first += by; again(section); }}}, text);
  const outcomes = [["", "all"], ...[...new Set(data.cells.map(outcome))].sort().map((word) => [word, word])];
  section.append(element("p", {class: "controls"}, picker("Verdict", outcomes, state.outcome, (word) => { Object.assign(state, {outcome: word, first: 0}); again(section); }), " ", turn(-kVerdictPage, "Previous"), " ", turn(kVerdictPage, "Next")));
  section.append(element("p", {id: "verdict-count"}, cells.length === 0 ? "No cell passes the filters." : `Cells ${state.first + 1} to ${last} of ${cells.length}`));
  section.append(element("div", {class: "scroll"}, element("table", {id: "verdict-table"}, element("thead", {}, verdictHead(section)), element("tbody", {}, ...cells.slice(state.first, last).map(verdictRow)))));
}

function drawReproduce(section) {
  section.append(element("pre", {}, [...data.runs.flatMap((run) => run.commands), data.command].join("\n")));
  for (const run of data.runs)
    section.append(element("details", {}, element("summary", {}, `Provenance of ${run.file} (configuration ${run.config_hash})`), element("pre", {}, JSON.stringify(run.provenance, null, 1))));
}

const hasPictures = () => data.cells.some((cell) => cell.images);
const kSections = [
  {id: "tables", title: "Published and measured", answer: "What a source says, beside what the same cells give here; pictures are the cells' estimates.", has: () => data.tables.length > 0, draw: drawTables},
  {id: "summary", title: "Which tracker?", answer: "The least time of a ray to a relative error of 1 %; “=”: the 95 % intervals do not tell them apart.", has: () => true, draw: drawSummary, filtered: true},
  {id: "ranking", title: "Ranking of a scene", answer: "Times are of one ray on one thread, intervals 95 %.", has: () => data.scenes.length > 0, draw: drawRanking, filtered: true},
  {id: "error", title: "Error over time", answer: "What halving the error costs.", has: () => data.cells.some((cell) => cell.convergence.length > 1), draw: drawError},
  {id: "pareto", title: "Variance over time of a sample", answer: "Which trackers are never the best choice.", has: () => data.cells.some((cell) => cell.time && cell.cost), draw: drawPareto},
  {id: "matrix", title: "Trackers × scenes", answer: "Where each tracker is good.", has: () => data.scenes.length > 0, draw: drawMatrix},
  {id: "maps", title: "Maps of variance and cost", answer: "Where in the scene variance and lookups arise.", has: hasPictures, draw: drawMaps},
  {id: "strips", title: "Pictures", answer: "What the errors look like.", has: hasPictures, draw: drawStrips},
  {id: "scaling", title: "How cost grows", answer: "Exponents of cost over one parameter.", has: () => data.scaling.length > 0, draw: drawScaling},
  {id: "verdicts", title: "Verdicts", answer: "Is it unbiased, and how well is that known?", has: () => true, draw: drawVerdicts, filtered: true},
  {id: "reproduce", title: "Reproduce", answer: "Commands and provenance.", has: () => true, draw: drawReproduce},
];

/// Draws what stands below a section's heading anew.
function again(section) {
  const {draw: drawn} = kSections.find(({id}) => id === section.parentElement.id);
  section.replaceChildren();
  drawn(section);
}

function buildSections() {
  const main = document.getElementById("main"), contents = document.getElementById("contents");
  for (const {id, title, answer, has, draw: drawn} of kSections) {
    if (!has()) continue;
    contents.append(element("a", {href: `#${id}`}, title));
    const body = element("div");
    main.append(element("section", {id, "aria-labelledby": `${id}-title`}, element("h2", {id: `${id}-title`}, title), element("p", {class: "answer"}, answer), body));
    drawn(body);
  }
}

/// After a change of filters or scene.
function refresh() {
  if (sceneSelect) fillSceneSelect();
  chosen.verdicts.first = 0;
  for (const {id, filtered} of kSections) {
    const section = filtered && document.getElementById(id);
    if (section) again(section.lastElementChild);
  }
  redraw();
}

/// On paper every plot is there, in light colours.
function preparePrint() {
  const theme = document.documentElement.dataset.theme;
  document.documentElement.dataset.theme = "light";
  document.querySelectorAll("#reproduce details").forEach((details) => { details.open = true; });
  figures.forEach(draw);
  window.addEventListener("afterprint", () => { document.documentElement.dataset.theme = theme; redraw(); }, {once: true});
}

// `?figures=1`: the main plots as SVG and PNG for papers, left in the page for whoever loads it.

const slug = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 80);
const kMostScenes = 12;

function paperPlots() {
  const plots = [];
  const add = (name, plot, height = 520) => { if (plot.data.length > 0) plots.push({name, plot, height: plot.layout.height || height}); };
  visibleScenes().slice(0, kMostScenes).forEach((s, i) => {
    const suffix = `${i + 1}-${slug(data.scenes[s].medium)}`;
    for (const mode of Object.keys(kErrorModes)) add(`error-over-${mode}-${suffix}`.replace("error-over-variance", "variance-over-samples"), errorPlot(sceneCells(s), mode));
    add(`pareto-${suffix}`, paretoPlot(sceneCells(s)));
    const pictured = sceneCells(s).filter((cell) => cell.images);
    add(`maps-${suffix}`, pictureGrid(data, pictured, kMapColumns));
    add(`strips-${suffix}`, pictureGrid(data, pictured, kStripColumns));
  });
  if (data.scenes.length > 0) add("matrix", matrixPlot(data, visibleCells(), "variance_x_ns"));
  for (const axis of new Set(data.scaling.map((series) => series.axis))) add(`scaling-${slug(axis)}`, scalingPlot(data.scaling.slice(0, 60), axis, "ns_per_sample"));
  return plots;
}

async function exportFigures() {
  const made = [];
  for (const {name, plot, height} of paperPlots()) {
    const spec = {data: plot.data, layout: {...themed(plot.layout, true), width: 1000, height}};
    const svg = await Plotly.toImage(spec, {format: "svg", width: 1000, height});
    const png = await Plotly.toImage(spec, {format: "png", width: 1000, height, scale: 2});
    made.push({name, svg: decodeURIComponent(svg.slice(svg.indexOf(",") + 1)), png: png.slice(png.indexOf(",") + 1)});
  }
  document.body.append(element("script", {type: "application/json", id: "figures"}, JSON.stringify(made).replace(/</g, "\\u003c")));
  document.documentElement.dataset.ready = "figures";
}

function start() {
  document.getElementById("title").textContent = data.title;
  document.getElementById("subtitle").textContent = `${data.cells.length} cells, ${data.scenes.length} scenes · ${data.version}`;
  document.getElementById("footer").textContent = "Drawn by plotly.js; its licence is in this file.";
  assignStyles(data.cells);
  buildFilters();
  if (sceneSelect) fillSceneSelect();
  if (new URLSearchParams(location.search).has("figures")) {
    exportFigures();
    return;
  }
  buildSections();
  if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
  window.addEventListener("beforeprint", preparePrint);
  document.documentElement.dataset.ready = "page";
}

start();
