// Plots: drawn by plotly.js when they come into view, again when the theme or the width changes.

/** Dragging zooms and a double click shows all again; buttons over the plot would hide it. */
const plotConfig = { displayModeBar: false };

const figures = new Set();

const sight = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    sight.unobserve(target);
    setTimeout(drawIfWanted, 0, target);
  }
}, { rootMargin: "300px" });

/** A plot that came into view may be gone, or drawn for paper, when its turn comes. */
function drawIfWanted(plot) {
  for (const figure of figures) if (figure.plot === plot && !figure.drawn) drawFigure(figure);
}

/**
 * Adds a plot.  `describe(width, theme)` gives {traces, layout} with the height in the layout, `caption` the key numbers for
 * those who do not see it, `numbers()` a table of all of them.
 */
function addFigure(parent, { title, caption, height, describe, numbers }) {
  const plot = element("div", { className: "graph", role: "img", "aria-label": `${title}. ${caption}` });
  plot.style.minHeight = `${height}px`;
  const whole = element("figure", {}, element("h4", {}, title), plot, element("figcaption", {}, caption));
  if (numbers) whole.append(numbersDetails(numbers));
  parent.append(whole);
  const figure = { plot, describe, drawn: false };
  figures.add(figure);
  sight.observe(plot);
}

function baseLayout(theme) {
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 12, color: theme.ink },
    margin: { l: 64, r: 16, t: 12, b: 48 },
    hoverlabel: { bgcolor: theme.paper, bordercolor: theme.muted, font: { color: theme.ink }, align: "left" },
    hovermode: "closest",
  };
}

function axis(theme, title, more = {}) {
  return {
    title: { text: plotText(title), standoff: 8 },
    gridcolor: theme.grid,
    linecolor: theme.muted,
    zeroline: false,
    showline: true,
    ticks: "outside",
    tickcolor: theme.muted,
    automargin: true,
    ...more,
  };
}

/** Round numbers from low to high, at least three of them. */
function roundTicks(low, high) {
  const rough = (high - low) / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [5, 2, 1].find((factor) => factor * power <= rough);
  const ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high; ++k) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

/** Ticks at powers of ten, at 1, 2, 5 where the values span too few of those, at round numbers where too few of these. */
function logAxis(theme, title, values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const span = Math.log10(high / low);
  const format = { type: "log", exponentformat: "power", minexponent: 2 };
  if (span > 0 && span < 0.75) return axis(theme, title, { ...format, tickmode: "array", tickvals: roundTicks(low, high), ticktext: roundTicks(low, high).map((x) => formatNumber(x, 3)) });
  return axis(theme, title, { ...format, dtick: span > 2 || span === 0 ? Math.max(1, Math.ceil(span / 8)) : "D2" });
}

/** Names go beside a wide plot and below a narrow one. */
function legendFor(width, count) {
  const below = { orientation: "h", x: 0, y: -0.22, yanchor: "top" };
  const font = { size: count > 10 ? 10 : 11 };
  return width < 620 ? { ...below, font } : { x: 1.02, y: 1, font };
}

/** What A4 and letter paper have room for between their margins, in pixels. */
const printedWidth = 690;

function widthOf(plot) {
  return "paper" in document.documentElement.dataset ? printedWidth : plot.clientWidth;
}

function drawFigure(figure) {
  const width = widthOf(figure.plot);
  const { traces, layout } = figure.describe(width, currentTheme());
  figure.plot.style.minHeight = `${layout.height}px`;
  Plotly.react(figure.plot, traces, { ...layout, width }, plotConfig);
  figure.drawn = true;
}

function drawAllFigures() {
  for (const figure of figures) drawFigure(figure);
}

function redrawFigures() {
  for (const figure of figures) if (figure.drawn) drawFigure(figure);
}

/** Empties a part of the page, with the plots in it. */
function clear(parent) {
  for (const figure of figures) {
    if (!parent.contains(figure.plot)) continue;
    sight.unobserve(figure.plot);
    Plotly.purge(figure.plot);
    figures.delete(figure);
  }
  parent.replaceChildren();
}

function followWidth() {
  let width = innerWidth;
  let waiting = 0;
  addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      if (innerWidth !== width) redrawFigures();
      width = innerWidth;
    }, 150);
  });
}

/** Arrays of a plot's error bars from intervals; an unbounded side has none. */
function errorBars(intervals, theme) {
  const side = (of) => intervals.map((interval) => (isNumber(of(interval)) ? of(interval) : 0));
  return {
    type: "data",
    symmetric: false,
    array: side((i) => (isNumber(i?.high) ? i.high - i.value : 0)),
    arrayminus: side((i) => (isNumber(i?.low) ? i.value - i.low : 0)),
    thickness: 1,
    width: 2,
    color: theme.colour,
  };
}

/** Few scenes side by side, of many the chosen one; returns what to call when filters have changed. */
function scenePanels(body, hasSomething, showScene, controls = []) {
  const choice = selectOf("Scene", [], (value) => chooseScene(Number(value)));
  const bar = element("div", { className: "controls" }, ...controls, choice.label);
  const panels = element("div", { className: "panels" });
  body.append(bar, panels);
  return () => {
    const scenes = scenesWith(hasSomething);
    const few = scenes.length <= fewScenes;
    setOptions(choice.select, scenes.map((scene) => [String(scene.index), scene.short]));
    choice.label.hidden = few;
    const shown = few ? scenes : [scenes.find((scene) => scene.index === chosenScene) ?? scenes[0]];
    if (!few) choice.select.value = String(shown[0].index);
    clear(panels);
    panels.classList.toggle("several", shown.length > 1);
    for (const scene of shown) showScene(panels, scene);
    if (scenes.length === 0) panels.append(nothingLeft());
  };
}

function nothingLeft() {
  return element("p", { className: "nothing" }, "The filters leave nothing to show here.");
}
