// Error over time, over lookups, and variance over samples, one curve a tracker.

const convergenceViews = {
  time: { title: "Error over time", x: (step) => step.seconds, xTitle: "seconds of one ray on one thread", y: "rmse", slope: -0.5 },
  lookups: { title: "Error over lookups", x: (step) => exactly(step.lookups), xTitle: "lookups of one ray", y: "rmse", slope: -0.5 },
  samples: { title: "Variance over samples", x: (step) => exactly(step.samples), xTitle: "samples of one ray", y: "variance", slope: -1 },
};
const convergenceTitles = { rmse: "RMSE / RMS of the reference", variance: "variance of the mean" };

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
  // One floor stands for all in the legend.
  const traces = [
    ...floorsOf(shown, view).map((cell, i) => ({ ...floorTrace(cell, ends, theme), ...(i === 0 ? { showlegend: true, name: "floor of a bias" } : {}) })),
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
