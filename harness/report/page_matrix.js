// The matrix of efficiencies: every tracker in every scene, relative to the best unbiased of the scene.

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
    const unbiased = rivals.filter(({ cell }) => standsUnbiased(cell));
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
    label, scene.name, `${view.title}: ${formatInterval(entry.cost)}${unprovenMark(entry.cost)}`, entry.nothing ? nothingText(entry) : relative,
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

function matrixCaption({ scenes, entries }) {
  // Rows of one tracker, such as of several numbers of samples, are no rivals.
  const trackers = groupedBy(entries.map((line) => line.filter(({ cell }) => cell)), ([{ cell }]) => cell.estimator);
  const wins = (lines) => new Set(lines.flat().filter(({ relative, cell }) => relative === 1 && standsUnbiased(cell)).map(({ cell }) => cell.scene)).size;
  const named = [...trackers].map(([tracker, lines]) => [tracker, wins(lines)]).filter(([, count]) => count > 0).sort((a, b) => b[1] - a[1])
    .map(([tracker, count]) => `${tracker} ${count}`);
  return `${countOf(trackers.size, "estimator")} on ${countOf(scenes.length, "scene")}. Best unbiased of its column, and how often: ${listed(named, 4, "tracker") || "none"}. ${unprovenHint(entries.flat().map(({ cost }) => cost))}`;
}

function matrixNumbers({ labels, scenes, entries }) {
  const rows = scenes.map((scene, column) => [scene.short, ...entries.map((line) => `${formatInterval(line[column].cost)}${unprovenMark(line[column].cost)}`)]);
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
