// Costs and variance over swept parameters, and the power that they grow with.

const scalingViews = {
  ns_per_sample: { title: "ns a sample", exponent: "exponent", of: (point) => point.ns_per_sample },
  lookups: { title: "lookups a sample", exponent: "exponent_lookups", of: (point) => exactly(point.lookups) },
  variance: { title: "variance / mean²", exponent: "exponent_variance", of: (point) => exactly(point.relative_variance) },
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
      `exponent: ${formatInterval(series[view.exponent])}`,
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
    caption: `Exponent of ${view.title}: ${listed(group.series.map((series) => scalingLabel(series, view)), 6)}.`,
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
