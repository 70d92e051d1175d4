// Error over time, the Pareto front, the matrix of efficiencies, costs over swept parameters.

const convergenceViews = {
  time: { title: "Error over time", x: (step) => step.seconds, xTitle: "seconds of one ray on one thread", y: "rmse", slope: -0.5 },
  lookups: { title: "Error over lookups", x: (step) => exactly(step.lookups), xTitle: "lookups of one ray", y: "rmse", slope: -0.5 },
  samples: { title: "Variance over samples", x: (step) => exactly(step.samples), xTitle: "samples of one ray", y: "variance", slope: -1 },
};
const convergenceTitles = { rmse: "RMSE / RMS of the reference", variance: "variance of the mean" };

function exactly(x) {
  return isNumber(x) ? { value: x, low: x, high: x } : null;
}

/** The steps of a cell that logarithmic axes can show. */
function stepsOf(cell, view) {
  return cell.convergence
    .map((step) => ({ samples: step.samples, x: view.x(step), y: step[view.y] }))
    .filter(({ x, y }) => x?.value > 0 && y?.value > 0);
}

function isRounding(steps, view) {
  return steps.every(({ y }) => y.value < (view.y === "rmse" ? rounding : rounding * rounding));
}

function convergenceCurves(scene, view) {
  const curves = cellsOf(scene).map((cell) => ({ cell, steps: stepsOf(cell, view) })).filter(({ steps }) => steps.length > 0);
  const shown = curves.filter(({ steps }) => !isRounding(steps, view));
  return { shown: shown.length > 0 ? shown : curves, exact: shown.length > 0 ? curves.filter((curve) => !shown.includes(curve)) : [] };
}

function hoverOfStep(cell, view, step) {
  const error = step.y.low === step.y.high ? "" : ` ${formatEnds(step.y, (x) => formatNumber(x, 3))}`;
  return plotLines([
    cell.label,
    `${convergenceTitles[view.y]}: ${formatNumber(step.y.value)}${error}`,
    `${view.xTitle}: ${formatNumber(step.x.value)}`,
    countOf(step.samples, "sample"),
  ]);
}

function convergenceTrace({ cell, steps }, view, theme) {
  const style = styleOf(cell.label, theme);
  return {
    type: "scatter",
    mode: "lines+markers",
    name: plotText(cell.label),
    x: steps.map(({ x }) => x.value),
    y: steps.map(({ y }) => y.value),
    error_x: errorBars(steps.map(({ x }) => x), style),
    error_y: errorBars(steps.map(({ y }) => y), style),
    line: { color: style.colour, dash: style.dash, width: 1.5 },
    marker: { color: style.colour, symbol: style.symbol, size: 7 },
    hoverinfo: "text",
    text: steps.map((step) => hoverOfStep(cell, view, step)),
  };
}

function floorTrace(cell, ends, theme) {
  const { floor } = cell.cost;
  const style = styleOf(cell.label, theme);
  return {
    type: "scatter",
    mode: "lines",
    name: plotText(`floor of ${cell.label}`),
    x: ends,
    y: [floor.value, floor.value],
    line: { color: style.colour, dash: "dash", width: 1 },
    showlegend: false,
    hoverinfo: "text",
    text: plotText(`floor of ${cell.label}: ${formatInterval(floor, formatPercent)}`),
  };
}

function guideTrace(scene, curves, view, ends, theme) {
  const { steps } = curves.find(({ cell }) => cell.index === scene.best_unbiased) ?? curves[0];
  const start = steps[0];
  const at = (x) => start.y.value * (x / start.x.value) ** view.slope;
  return {
    type: "scatter",
    mode: "lines",
    name: view.slope === -1 ? "slope −1" : "slope −1/2",
    x: ends,
    y: ends.map(at),
    line: { color: theme.muted, dash: "dot", width: 1.5 },
    hoverinfo: "skip",
  };
}

function floorsOf(curves, view) {
  return view.y === "rmse" ? curves.map(({ cell }) => cell).filter((cell) => cell.cost?.floor?.value > rounding) : [];
}

function convergencePlot(scene, view, width, theme) {
  const { shown } = convergenceCurves(scene, view);
  const xs = shown.flatMap(({ steps }) => steps.map(({ x }) => x.value));
  const ends = [Math.min(...xs), Math.max(...xs)];
  const traces = [
    ...floorsOf(shown, view).map((cell) => floorTrace(cell, ends, theme)),
    guideTrace(scene, shown, view, ends, theme),
    ...shown.map((curve) => convergenceTrace(curve, view, theme)),
  ];
  const narrow = width < 620;
  return {
    traces,
    layout: {
      ...baseLayout(theme),
      height: narrow ? 380 + 20 * shown.length : 440,
      xaxis: logAxis(theme, view.xTitle, xs),
      yaxis: logAxis(theme, convergenceTitles[view.y], shown.flatMap(({ steps }) => steps.map(({ y }) => y.value))),
      legend: legendFor(width, shown.length),
    },
  };
}

function convergenceCaption(scene, view) {
  const { shown, exact } = convergenceCurves(scene, view);
  const last = shown.map(({ cell, steps }) => {
    const { x, y } = steps[steps.length - 1];
    return `${cell.label} ${formatNumber(y.value, 3)} at ${view.y === "rmse" && view === convergenceViews.time ? formatSeconds(x.value) : formatNumber(x.value, 3)}`;
  });
  const floors = floorsOf(shown, view).map((cell) => `${cell.label} ${formatPercent(cell.cost.floor.value)}`);
  return [
    `With the most samples: ${listed(last)}.`,
    floors.length > 0 ? `Dashed floors, which no number of samples passes: ${listed(floors)}.` : "",
    exact.length > 0 ? `Exact but for rounding, so below the scale: ${listed(exact.map(({ cell }) => cell.label))}.` : "",
  ].join(" ").trim();
}

function convergenceNumbers(scene, view) {
  const { shown, exact } = convergenceCurves(scene, view);
  const rows = [...shown, ...exact].flatMap(({ cell, steps }) =>
    steps.map(({ samples, x, y }) => [markedLabel(cell.label), String(samples), formatInterval(x), formatInterval(y)]));
  return plainTable(["estimator", "samples", view.xTitle, convergenceTitles[view.y]], rows);
}

function convergenceFigure(scene, view) {
  return {
    title: `${view.title}: ${scene.short}`,
    caption: convergenceCaption(scene, view),
    height: 440,
    describe: (width, theme) => convergencePlot(scene, view, width, theme),
    numbers: () => convergenceNumbers(scene, view),
  };
}

/** Results without timing still show errors over lookups. */
function usefulConvergenceViews() {
  return Object.entries(convergenceViews).filter(([, view]) => report.cells.some((cell) => stepsOf(cell, view).length > 0));
}

function buildError(body) {
  const views = usefulConvergenceViews();
  let view = views[0][1];
  const choice = selectOf("Show", views.map(([key, { title }]) => [key, title.toLowerCase()]), (key) => {
    view = convergenceViews[key];
    update();
  });
  const drawable = (cell) => stepsOf(cell, view).length > 0;
  const update = scenePanels(body, drawable, (panel, scene) => addFigure(panel, convergenceFigure(scene, view)), [choice.label]);
  return update;
}

function hasParetoPoint(cell) {
  return hasCostAndTime(cell) && cell.time.ns_per_sample.value > 0 && !hasNoNoise(cell);
}

function hoverOfCost(cell) {
  return plotLines([
    labelWithFloor(cell),
    `variance of a sample: ${formatInterval(cell.cost.variance)}`,
    `time of a sample: ${formatInterval(cell.time.ns_per_sample)} ns`,
    `variance × ns: ${formatInterval(cell.cost.variance_x_ns)}`,
  ]);
}

function paretoTrace(cell, theme) {
  const style = styleOf(cell.label, theme);
  const { ns_per_sample: time } = cell.time;
  return {
    type: "scatter",
    mode: "markers",
    name: plotText(labelWithFloor(cell)),
    x: [time.value],
    y: [cell.cost.variance.value],
    error_x: errorBars([time], style),
    error_y: errorBars([cell.cost.variance], style),
    marker: { color: style.colour, symbol: style.symbol, size: 11 },
    hoverinfo: "text",
    text: [hoverOfCost(cell)],
  };
}

function frontTrace(cells, theme) {
  const front = cells.filter((cell) => cell.cost.pareto).sort((a, b) => a.time.ns_per_sample.value - b.time.ns_per_sample.value);
  return {
    type: "scatter",
    mode: "lines",
    name: "front",
    x: front.map((cell) => cell.time.ns_per_sample.value),
    y: front.map((cell) => cell.cost.variance.value),
    line: { color: theme.muted, dash: "dot", shape: "hv", width: 1.5 },
    hoverinfo: "skip",
  };
}

function paretoPlot(scene, width, theme) {
  const cells = cellsOf(scene).filter(hasParetoPoint);
  return {
    traces: [frontTrace(cells, theme), ...cells.map((cell) => paretoTrace(cell, theme))].filter(({ mode, x }) => mode !== "lines" || x.length > 1),
    layout: {
      ...baseLayout(theme),
      height: width < 620 ? 360 + 20 * cells.length : 400,
      xaxis: logAxis(theme, "ns a sample", cells.map((cell) => cell.time.ns_per_sample.value)),
      yaxis: logAxis(theme, "variance of a sample", cells.map((cell) => cell.cost.variance.value)),
      legend: legendFor(width, cells.length),
    },
  };
}

function paretoCaption(scene) {
  const cells = cellsOf(scene).filter(hasCostAndTime);
  const front = cells.filter((cell) => cell.cost.pareto).map(labelWithFloor);
  const still = cells.filter(hasNoNoise).map((cell) => `${labelWithFloor(cell)} ${formatInterval(cell.time.ns_per_sample)} ns`);
  return [
    front.length > 0 ? `On the front: ${listed(front, 8)}.` : "",
    still.length > 0 ? `Without variance, so not on a logarithmic axis: ${listed(still)}.` : "",
  ].join(" ").trim();
}

function costNumbers(scene) {
  const rows = cellsOf(scene).filter(hasCostAndTime).map((cell) => [
    markedLabel(cell.label), formatInterval(cell.time.ns_per_sample), formatInterval(cell.cost.variance),
    formatInterval(cell.cost.variance_x_ns), cell.cost.pareto ? "yes" : "no", floorText(cell)]);
  return plainTable(["estimator", "ns a sample", "variance of a sample", "variance × ns", "on the front", "floor of the error"], rows);
}

function paretoFigure(scene) {
  return {
    title: `Variance over time of a sample: ${scene.short}`,
    caption: paretoCaption(scene),
    height: 400,
    describe: (width, theme) => paretoPlot(scene, width, theme),
    numbers: () => costNumbers(scene),
  };
}

function buildPareto(body) {
  return scenePanels(body, hasParetoPoint, (panel, scene) => addFigure(panel, paretoFigure(scene)));
}

const matrixViews = {
  variance_x_ns: { title: "variance × ns", of: (cell) => (cell.time ? cell.cost?.variance_x_ns : null) },
  variance_x_lookups: { title: "variance × lookups", of: (cell) => cell.cost?.variance_x_lookups },
  seconds_1: { title: "seconds to\u00a01\u00a0%", of: (cell) => secondsTo(cell, 0) },
  seconds_01: { title: "seconds to\u00a00.1\u00a0%", of: (cell) => secondsTo(cell, 1) },
};

/** A cost so many powers of ten above the best is not told from a higher one by its colour. */
const mostDecades = 4;

/** With more scenes than fit side by side they become the rows. */
const mostColumns = 24;

/** Rows and columns that the filters leave something of, with each cell's cost relative to the best unbiased of its column. */
function matrixOf(view) {
  const { rows, columns, cells } = report.matrix;
  const costAt = (row, column) => {
    const place = cells[row][column];
    const cell = place === null ? null : report.cells[place];
    return cell && passes(cell) ? { cell, cost: view.of(cell) } : null;
  };
  const grid = rows.map((_, row) => columns.map((_, column) => costAt(row, column)));
  const known = (entry) => isNumber(entry?.cost?.value);
  const keptRows = rows.map((_, row) => row).filter((row) => grid[row].some(known));
  const keptColumns = columns.map((_, column) => column).filter((column) => keptRows.some((row) => known(grid[row][column])));
  const best = keptColumns.map((column) => {
    const rivals = keptRows.map((row) => grid[row][column]).filter((entry) => known(entry) && entry.cost.value !== 0);
    const unbiased = rivals.filter(({ cell }) => claimsUnbiased(cell));
    return Math.min(...(unbiased.length > 0 ? unbiased : rivals).map(({ cost }) => cost.value));
  });
  return {
    labels: keptRows.map((row) => rows[row]),
    scenes: keptColumns.map((column) => report.scenes[columns[column].scene]),
    entries: keptRows.map((row) => keptColumns.map((column, place) => relativeEntry(grid[row][column], best[place]))),
  };
}

function relativeEntry(entry, best) {
  const value = entry?.cost?.value;
  if (!isNumber(value)) return { ...entry, relative: null };
  const nothing = value === 0;
  return { ...entry, relative: nothing ? null : value / best, nothing };
}

/** What stands in for a cost of nothing: samples without variance are exact, or wrong without noise. */
function nothingText({ cell }) {
  if (!hasNoNoise(cell)) return "0";
  return isExact(cell) ? "exact" : `no noise, error ${floorText(cell)}`;
}

function matrixText(entry) {
  if (!entry.cell) return "";
  if (entry.nothing) return plotLines(nothingText(entry).split(/(?<=,) /));
  if (entry.relative === null) return "";
  const floor = floorText(entry.cell);
  return plotLines([formatNumber(entry.relative, entry.relative < 100 ? 2 : 3), ...(floor ? [`floor ${floor}`] : [])]);
}

function hoverOfEntry(entry, view, label, scene) {
  if (!entry.cell) return plotLines([label, scene.name, "not measured"]);
  const relative = entry.relative === null ? "" : `${formatNumber(entry.relative, 3)} times the best unbiased of the scene`;
  const floor = floorText(entry.cell);
  return plotLines([
    label, scene.name, `${view.title}: ${formatInterval(entry.cost)}`, entry.nothing ? nothingText(entry) : relative,
    ...(floor ? [`floor of the error ${floor}`] : [])]);
}

function decades(most) {
  return Array.from({ length: Math.floor(most) + 1 }, (_, exponent) => exponent);
}

function matrixAnnotations(texts, shades, most, theme) {
  const ink = (shade) => (shade === null ? theme.ink : shade > 0.55 * most ? "#000000" : "#ffffff");
  return texts.flatMap((line, row) => line.map((text, column) => ({
    x: column,
    y: texts.length - 1 - row,
    text,
    showarrow: false,
    font: { size: 10, color: ink(shades[row][column]) },
  }))).filter(({ text }) => text !== "");
}

function transposed(grid) {
  return grid[0].map((_, column) => grid.map((line) => line[column]));
}

function shadeOf(entry) {
  if (entry.nothing) return floorText(entry.cell) ? null : 0;
  return entry.relative === null ? null : Math.log10(entry.relative);
}

function matrixPlot({ labels, scenes, entries }, view, theme) {
  const hover = entries.map((line, row) => line.map((entry, column) => hoverOfEntry(entry, view, labels[row], scenes[column])));
  const names = scenes.map((scene) => scene.short);
  const scenesDown = scenes.length > mostColumns;
  const turned = (grid) => (scenesDown ? transposed(grid) : grid);
  const marked = labels.map((label, row) => (entries[row].some(({ cell }) => cell && floorText(cell)) ? `${label} (biased)` : label));
  const [down, across] = scenesDown ? [names, marked] : [marked, names];
  const shades = turned(entries.map((line) => line.map(shadeOf)));
  const most = Math.min(mostDecades, Math.max(1, ...shades.flat()));
  const upwards = (rows) => [...rows].reverse();
  const rowHeight = Math.max(6, Math.min(26, 2400 / down.length));
  const angle = across.length > 4 ? -40 : 0;
  return {
    traces: [{
      type: "heatmap",
      z: upwards(shades),
      zmin: 0,
      zmax: most,
      colorscale: plotlyScale(cividis),
      xgap: 1,
      ygap: 1,
      hoverinfo: "text",
      text: upwards(turned(hover)),
      colorbar: {
        title: { text: "times the best unbiased", side: "right" },
        tickvals: decades(most),
        ticktext: decades(most).map((exponent) => (exponent < mostDecades ? String(10 ** exponent) : `10<sup>${exponent}</sup> or more`)),
        thickness: 12,
        outlinewidth: 0,
        lenmode: "pixels",
        len: Math.max(120, Math.min(400, rowHeight * down.length)),
      },
    }],
    layout: {
      ...baseLayout(theme),
      height: 80 + rowHeight * down.length + (angle === 0 ? 0 : 150),
      plot_bgcolor: "rgba(128,128,128,.22)",
      annotations: across.length <= 16 && rowHeight > 14 ? matrixAnnotations(turned(entries.map((line) => line.map(matrixText))), shades, most, theme) : [],
      xaxis: matrixAxis(theme, across, angle, 1),
      yaxis: matrixAxis(theme, upwards(down), 0, Math.ceil(13 / rowHeight)),
    },
  };
}

function matrixAxis(theme, names, angle, every) {
  const places = names.map((_, place) => place).filter((place) => place % every === 0);
  return {
    ...axis(theme, ""),
    showgrid: false,
    tickmode: "array",
    tickvals: places,
    ticktext: places.map((place) => plotText(shortened(names[place], 40))),
    tickangle: angle,
    tickfont: { size: 10 },
  };
}

function matrixCaption({ labels, scenes, entries }) {
  const best = labels.map((label, row) => [label, entries[row].filter(({ relative, cell }) => relative === 1 && claimsUnbiased(cell)).length]).sort((a, b) => b[1] - a[1]);
  const named = best.filter(([, count]) => count > 0).map(([label, count]) => `${label} ${count}`);
  return `${countOf(labels.length, "estimator")} on ${countOf(scenes.length, "scene")}. Best unbiased of its column, and how often: ${listed(named) || "none"}.`;
}

function matrixNumbers({ labels, scenes, entries }) {
  const rows = scenes.map((scene, column) => [scene.short, ...entries.map((line) => formatInterval(line[column].cost))]);
  return plainTable(["scene", ...labels], rows);
}

function matrixFigure(view) {
  const matrix = matrixOf(view);
  return {
    title: `${view.title}, relative to the best unbiased of each scene`,
    caption: matrixCaption(matrix),
    height: 130 + 26 * matrix.labels.length,
    describe: (_, theme) => matrixPlot(matrix, view, theme),
    numbers: () => matrixNumbers(matrix),
    empty: matrix.labels.length === 0,
  };
}

function usefulMatrixViews() {
  return Object.entries(matrixViews).filter(([, view]) => report.cells.some((cell) => isNumber(view.of(cell)?.value)));
}

function buildMatrix(body) {
  const views = usefulMatrixViews();
  let view = views[0][1];
  const choice = selectOf("Show", views.map(([key, { title }]) => [key, title]), (key) => {
    view = matrixViews[key];
    update();
  });
  const panel = element("div", {});
  body.append(element("div", { className: "controls" }, choice.label), panel);
  const update = () => {
    clear(panel);
    const figure = matrixFigure(view);
    if (figure.empty) panel.append(nothingLeft());
    else addFigure(panel, figure);
  };
  return update;
}

const scalingViews = {
  ns_per_sample: { title: "ns a sample", exponent: "exponent", of: (point) => point.ns_per_sample },
  lookups: { title: "lookups a sample", exponent: "exponent_lookups", of: (point) => exactly(point.lookups) },
};

/** Series that differ in nothing but the estimator share a plot. */
function scalingGroups(view) {
  const groups = new Map();
  for (const series of report.scaling) {
    const points = series.points.filter((point) => passes(report.cells[point.cell]) && point.x > 0 && view.of(point)?.value > 0);
    if (points.length === 0) continue;
    const key = `${series.axis} | ${series.rest}`;
    if (!groups.has(key)) groups.set(key, { axis: series.axis, rest: series.rest, series: [] });
    groups.get(key).series.push({ ...series, points });
  }
  return [...groups.values()];
}

function scalingLabel(series, view) {
  return `${series.estimator}: ${formatInterval(series[view.exponent], (x) => formatNumber(x, 2))}`;
}

function scalingTrace(series, view, theme) {
  const style = styleOf(report.cells[series.points[0].cell].label, theme);
  const costs = series.points.map(view.of);
  return {
    type: "scatter",
    mode: "lines+markers",
    name: plotText(scalingLabel(series, view)),
    x: series.points.map(({ x }) => x),
    y: costs.map(({ value }) => value),
    error_y: errorBars(costs, style),
    line: { color: style.colour, dash: style.dash, width: 1.5 },
    marker: { color: style.colour, symbol: style.symbol, size: 7 },
    hoverinfo: "text",
    text: series.points.map((point, i) => plotLines([
      series.estimator,
      `${series.axis}: ${formatNumber(point.x)}`,
      `${view.title}: ${formatInterval(costs[i])}`,
      `cost grows with the power ${formatInterval(series[view.exponent])}`,
    ])),
  };
}

function scalingPlot(group, view, width, theme) {
  const points = group.series.flatMap((series) => series.points);
  return {
    traces: group.series.map((series) => scalingTrace(series, view, theme)),
    layout: {
      ...baseLayout(theme),
      height: width < 620 ? 340 + 20 * group.series.length : 380,
      xaxis: logAxis(theme, group.axis, points.map(({ x }) => x)),
      yaxis: logAxis(theme, view.title, points.map((point) => view.of(point).value)),
      legend: { ...legendFor(width, group.series.length), title: { text: "exponent", font: { size: 11 } } },
    },
  };
}

function scalingNumbers(group, view) {
  const rows = group.series.flatMap((series) => series.points.map((point) => [
    markedLabel(report.cells[point.cell].label), formatNumber(point.x), formatInterval(view.of(point)),
    formatInterval(series[view.exponent]), formatInterval(series.exponent_upper)]));
  return plainTable(["estimator", group.axis, view.title, "exponent", "exponent of ns, upper half"], rows);
}

function scalingFigure(group, view) {
  return {
    title: `${view.title} over ${group.axis}: ${shortMedium(group.rest)}`,
    caption: `Cost grows with the power: ${listed(group.series.map((series) => scalingLabel(series, view)), 6)}.`,
    height: 380,
    describe: (width, theme) => scalingPlot(group, view, width, theme),
    numbers: () => scalingNumbers(group, view),
  };
}

function usefulScalingViews() {
  return Object.entries(scalingViews).filter(([, view]) => scalingGroups(view).length > 0);
}

function buildScaling(body) {
  const views = usefulScalingViews();
  let view = views[0][1];
  const choice = selectOf("Show", views.map(([key, { title }]) => [key, title]), (key) => {
    view = scalingViews[key];
    update();
  });
  const panels = element("div", { className: "panels" });
  body.append(element("div", { className: "controls" }, choice.label), panels);
  const update = () => {
    clear(panels);
    const groups = scalingGroups(view);
    panels.classList.toggle("several", groups.length > 1);
    for (const group of groups) addFigure(panels, scalingFigure(group, view));
    if (groups.length === 0) panels.append(nothingLeft());
  };
  return update;
}
