// The Pareto front: variance over time of a sample.

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
  const sorted = cells.filter((cell) => cell.cost.pareto).sort((a, b) => a.time.ns_per_sample.value - b.time.ns_per_sample.value);
  // Results of one tracker do not beat each other; the line goes through the best.
  const front = sorted.filter((cell, place) => sorted.slice(0, place).every((other) => other.cost.variance.value > cell.cost.variance.value));
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
      height: width < 620 ? 400 + 20 * (1 + cells.length) : 400,
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
