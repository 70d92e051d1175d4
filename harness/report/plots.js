"use strict";

// What each plot shows: functions from the data to traces and layout for Plotly, with the same numbers as rows of a table.

/// Okabe and Ito's colours, which the colour-blind can tell apart, but for yellow, which white paper swallows.
const kColours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f"];
const kSymbols = ["circle", "square", "diamond", "triangle-up", "cross", "x", "star", "triangle-down"];
const kDashes = ["solid", "dash", "dot", "dashdot", "longdash"];
const kSequential = "Cividis";
/// ColorBrewer's PuOr.
const kDiverging = [[0, "#b35806"], [0.25, "#fdb863"], [0.5, "#f7f7f7"], [0.75, "#b2abd2"], [1, "#542788"]];

const styles = new Map();
function assignStyles(cells) {
  [...new Set(cells.map((cell) => cell.estimator))].sort().forEach((name, i) => {
    styles.set(name, {
      colour: kColours[i % kColours.length],
      symbol: kSymbols[(i + 3 * Math.floor(i / kColours.length)) % kSymbols.length],
      dash: kDashes[Math.floor(i / kColours.length) % kDashes.length],
    });
  });
}

const kGuide = "#888888";

function logAxis(title) {
  return {title: {text: title}, type: "log", exponentformat: "power", automargin: true};
}

/// Lengths of the error bars of intervals; an end that is not known has none.
function errorBars(intervals) {
  const length = (interval, end) => (interval && interval[end] !== null ? Math.abs(interval[end] - interval.value) : 0);
  return {type: "data", symmetric: false, array: intervals.map((i) => length(i, "high")), arrayminus: intervals.map((i) => length(i, "low")), thickness: 1, width: 2};
}

const kErrorModes = {
  time: {text: "error over time", x: "seconds of one ray, one thread", y: "relative RMSE", slope: -0.5, abscissa: (p) => p.seconds && p.seconds.value, ordinate: "rmse"},
  lookups: {text: "error over lookups", x: "lookups of one ray", y: "relative RMSE", slope: -0.5, abscissa: (p) => p.lookups, ordinate: "rmse"},
  variance: {text: "variance over samples", x: "samples of one ray", y: "variance of the mean", slope: -1, abscissa: (p) => p.samples, ordinate: "variance"},
};

/// Relative errors below are of exact estimators, whose rounding would stretch the axis over all others.
const kRounding = 1e-9;

/// Error or variance as measured at 1, 2, 4, ... samples, a line of the slope that sampling has, and the floors of biased trackers.
function errorPlot(cells, mode) {
  const kind = kErrorModes[mode];
  const traces = [], rows = [];
  let guide = null, least = Infinity, most = 0;
  for (const cell of cells) {
    const points = cell.convergence.filter((p) => kind.abscissa(p) > 0 && p[kind.ordinate].value > 0);
    if (points.every((p) => p.rmse.value < kRounding)) continue;
    const style = styles.get(cell.estimator), x = points.map(kind.abscissa), y = points.map((p) => p[kind.ordinate]);
    least = Math.min(least, x[0]);
    most = Math.max(most, x[x.length - 1]);
    if (!guide && points.length > 1 && cell.claims === "unbiased") guide = {x: x[0], y: y[0].value};
    traces.push({
      type: "scatter", mode: "lines+markers", name: cell.estimator, legendgroup: cell.estimator, x, y: y.map((i) => i.value), error_y: errorBars(y),
      error_x: mode === "time" ? errorBars(points.map((p) => p.seconds)) : undefined,
      line: {color: style.colour, dash: style.dash, width: 1.5}, marker: {color: style.colour, symbol: style.symbol, size: 7},
      customdata: points.map((p) => p.samples),
      hovertemplate: `${plain(cell.estimator)}<br>%{customdata} samples<br>${kind.x}: %{x:.3e}<br>${kind.y}: %{y:.3e}<extra></extra>`,
    });
    for (const p of points) rows.push([cell.estimator, p.samples, kind.abscissa(p), p[kind.ordinate].value]);
  }
  for (const cell of cells) {
    const floor = mode !== "variance" && cell.cost && cell.cost.floor;
    if (!floor || !(floor.low > 0) || !(most > least)) continue;
    traces.push({
      type: "scatter", mode: "lines", name: `floor of ${cell.estimator}`, legendgroup: cell.estimator, showlegend: false, x: [least, most], y: [floor.value, floor.value],
      line: {color: styles.get(cell.estimator).colour, dash: "dot", width: 1}, hovertemplate: `floor of ${plain(cell.estimator)}: %{y:.3e}<extra></extra>`,
    });
  }
  if (guide && most > guide.x)
    traces.push({
      type: "scatter", mode: "lines", name: `slope ${kind.slope === -1 ? "−1" : "−1/2"}`, x: [guide.x, most], y: [guide.y, guide.y * (most / guide.x) ** kind.slope],
      line: {color: kGuide, width: 1, dash: "longdashdot"}, hoverinfo: "skip",
    });
  return {data: traces, layout: {xaxis: logAxis(kind.x), yaxis: logAxis(kind.y)}, numbers: {heads: [["estimator"], "samples", kind.x, kind.y], rows}};
}

/// Variance of one sample over its time; no tracker lies below and left of the front.
function paretoPlot(cells) {
  const shown = cells.filter((cell) => cell.cost && cell.cost.variance.value > 0 && cell.time && cell.time.ns_per_sample);
  const traces = shown.map((cell) => {
    const style = styles.get(cell.estimator), time = cell.time.ns_per_sample, variance = cell.cost.variance;
    return {
      type: "scatter", mode: "markers", name: cell.estimator, x: [time.value], y: [variance.value], error_x: errorBars([time]), error_y: errorBars([variance]),
      marker: {color: style.colour, symbol: style.symbol, size: 10, line: cell.cost.pareto ? {color: kGuide, width: 2} : undefined},
      hovertemplate: `${plain(cell.estimator)}<br>%{x:.3g} ns a sample<br>variance %{y:.3g}<extra></extra>`,
    };
  });
  const front = shown.filter((cell) => cell.cost.pareto).sort((a, b) => a.time.ns_per_sample.value - b.time.ns_per_sample.value);
  if (front.length > 1)
    traces.push({type: "scatter", mode: "lines", name: "front", x: front.map((c) => c.time.ns_per_sample.value), y: front.map((c) => c.cost.variance.value),
      line: {color: kGuide, width: 1, dash: "dash"}, hoverinfo: "skip"});
  return {
    data: traces, layout: {xaxis: logAxis("ns a sample"), yaxis: logAxis("variance of a sample")},
    numbers: {heads: [["estimator"], "ns a sample", "variance"], rows: shown.map((c) => [c.estimator, c.time.ns_per_sample.value, c.cost.variance.value])},
  };
}

const kMatrixModes = {
  variance_x_ns: {text: "variance × ns", value: (cell) => cell.cost && cell.cost.variance_x_ns && cell.cost.variance_x_ns.value},
  variance_x_lookups: {text: "variance × lookups", value: (cell) => cell.cost && cell.cost.variance_x_lookups && cell.cost.variance_x_lookups.value},
  percent: {text: "seconds to 1 %", value: (cell) => cell.cost && cell.cost.seconds[0].value},
  permille: {text: "seconds to 0.1 %", value: (cell) => cell.cost && cell.cost.seconds[1].value},
};

const kFewColumns = 12;

/// Each tracker against the best of its column.
function matrixPlot(data, visible, mode) {
  const value = kMatrixModes[mode].value;
  const lines = data.matrix.rows.map((name, r) => ({name, cells: data.matrix.cells[r].map((at) => (at !== null && visible.has(at) ? data.cells[at] : null))}))
    .filter((line) => line.cells.some((cell) => cell && value(cell) > 0));
  const columns = data.matrix.columns.map((column, c) => ({label: column.label, c})).filter(({c}) => lines.some((line) => line.cells[c] && value(line.cells[c]) > 0));
  const best = columns.map(({c}) => Math.min(...lines.map((line) => (line.cells[c] && value(line.cells[c]) > 0 ? value(line.cells[c]) : Infinity))));
  const ratio = (line, i) => { const cell = line.cells[columns[i].c]; return cell && value(cell) > 0 ? value(cell) / best[i] : null; };
  const ratios = lines.map((line) => columns.map((_, i) => ratio(line, i)));
  const few = columns.length <= kFewColumns, labels = distinctParts(columns.map(({label}) => label));
  const short = labels.map((parts, i) => (few ? parts.map(plain).join("<br>") : String(i + 1)));
  return {
    data: lines.length === 0 ? [] : [{
      type: "heatmap", x: short, y: lines.map((line) => line.name), z: ratios.map((row) => row.map((r) => (r === null ? null : Math.log10(r)))), colorscale: kSequential, reversescale: true,
      text: ratios.map((row) => row.map((r) => (r === null ? "" : shortNumber(r)))), 
      customdata: lines.map(() => columns.map(({label}) => plain(label))), hovertemplate: "%{y}<br>%{customdata}<br>%{text} times the best<extra></extra>",
      colorbar: {title: {text: "times the best"}, tickvals: [0, 1, 2, 3, 4, 6, 8], ticktext: ["1", "10", "100", "10³", "10⁴", "10⁶", "10⁸"]},
    }],
    layout: {xaxis: {automargin: true, type: "category", tickangle: 0}, yaxis: {automargin: true, type: "category"}, height: 26 * lines.length + 220, annotations: few ? written(ratios, short, lines) : []},
    numbers: {heads: [["estimator"], ["scene"], kMatrixModes[mode].text, "times the best"],
      rows: lines.flatMap((line, l) => columns.flatMap(({c, label}, i) => (ratios[l][i] === null ? [] : [[line.name, label, value(line.cells[c]), ratios[l][i]]])))},
  };
}

function picture(data, cell, kind) {
  return cell.images && cell.images[kind] !== undefined ? pixels(data.images[cell.images[kind]]) : null;
}

function product(data, cell, a, b) {
  const one = picture(data, cell, a), other = picture(data, cell, b);
  return one && other ? combined(one, other, (x, y) => x * y) : null;
}

const kMapColumns = [
  {title: "variance", decades: true, of: (data, cell) => picture(data, cell, "variance")},
  {title: "lookups", of: (data, cell) => picture(data, cell, "lookups")},
  {title: "null collisions", of: (data, cell) => picture(data, cell, "null_collisions")},
  {title: "variance × lookups", decades: true, of: (data, cell) => product(data, cell, "variance", "lookups")},
];

function signedError(data, cell) {
  const mean = picture(data, cell, "mean"), reference = picture(data, cell, "reference");
  return mean && reference ? combined(mean, reference, (x, y) => x - y) : null;
}

const kStripColumns = [
  {title: "reference", grey: true, of: (data, cell) => picture(data, cell, "reference")},
  {title: "estimate", grey: true, of: (data, cell) => picture(data, cell, "mean")},
  {title: "signed error", signed: true, of: signedError},
  {title: "variance", of: (data, cell) => picture(data, cell, "variance")},
  {title: "lookups", of: (data, cell) => picture(data, cell, "lookups")},
];

/// The value that 99 % of the pixels do not exceed: single bright pixels would darken all others.
function almostMost(pictures, magnitude) {
  const values = pictures.flatMap((rows) => rows.flat()).filter((v) => v !== null).map(magnitude).sort((a, b) => a - b);
  return values.length > 0 ? values[Math.floor(0.99 * (values.length - 1))] || values[values.length - 1] : 0;
}

const kBarLength = 110;
/// Of scales over decades: the least of the most that is told apart.
const kLeastShare = 1e-4;

function range({signed, decades}, most) {
  if (decades) return {cmin: Math.log10(most * kLeastShare), cmax: Math.log10(most)};
  return {cmin: signed ? -most : 0, cmax: most};
}

function barTicks({decades}, most) {
  if (!decades) return {};
  const powers = [0, 1, 2, 3, 4].map((p) => Math.floor(Math.log10(most)) - p).filter((p) => p >= Math.log10(most * kLeastShare));
  return {tickvals: powers, ticktext: powers.map((p) => `10<sup>${p}</sup>`)};
}

/// Pictures of the cells, one line each, columns on one scale.
function pictureGrid(data, cells, columns) {
  const shown = cells.filter((cell) => cell.images && columns.some((column) => column.of(data, cell)));
  const traces = [], layout = {annotations: [], height: 100 + kBarLength + 180 * shown.length, margin: {l: 10, r: 10, t: 80, b: kBarLength + 20}};
  const width = 1 / columns.length, height = 1 / Math.max(1, shown.length);
  columns.forEach((column, c) => {
    const pictures = shown.map((cell) => column.of(data, cell));
    const known = pictures.filter((p) => p);
    if (known.length === 0) return;
    const most = column.grey ? 1 : almostMost(known, column.signed ? Math.abs : (v) => v) || 1;
    layout[numbered("coloraxis", c + 1)] = {
      colorscale: column.grey ? "Greys" : column.signed ? kDiverging : kSequential, ...range(column, most),
      colorbar: {x: (c + 0.5) * width, xanchor: "center", y: 0, yanchor: "top", ypad: 0, lenmode: "pixels", len: kBarLength, thickness: 10, nticks: 5, exponentformat: "power", ...barTicks(column, most)},
    };
    pictures.forEach((z, r) => {
      if (!z) return;
      const axis = r * columns.length + c + 1, top = 1 - r * height;
      const x = numbered("x", axis), y = numbered("y", axis);
      layout[numbered("xaxis", axis)] = {domain: [c * width + 0.008, (c + 1) * width - 0.008], anchor: y, visible: false, constrain: "domain"};
      layout[numbered("yaxis", axis)] = {domain: [top - height * 0.86, top], anchor: x, visible: false, scaleanchor: x, constrain: "domain"};
      traces.push({type: "heatmap", z: column.decades ? z.map((row) => row.map((v) => (v === null ? null : Math.log10(Math.max(v, most * kLeastShare))))) : z, customdata: z, xaxis: x, yaxis: y, coloraxis: numbered("coloraxis", c + 1), name: `${shown[r].estimator}, ${column.title}`,
        hovertemplate: `${plain(shown[r].estimator)}<br>${column.title} %{customdata:.4g}<br>pixel %{x}, %{y}<extra></extra>`});
    });
    layout.annotations.push({text: column.title, x: (c + 0.5) * width, y: 1, yshift: 42, xref: "paper", yref: "paper", showarrow: false});
  });
  shown.forEach((cell, r) => layout.annotations.push({
    text: `${plain(cell.estimator)}${cell.experiment ? ` (${plain(cell.experiment)})` : ""} · RMSE ${shortNumber(cell.rmse[0])}`, x: 0, y: 1 - r * height, yshift: r === 0 ? 8 : 6, xanchor: "left", yanchor: "bottom",
    xref: "paper", yref: "paper", showarrow: false, font: {size: 11},
  }));
  return {data: traces, layout, numbers: {heads: [["estimator"], "RMSE", "variance", "lookups", "null collisions"],
    rows: shown.map((cell) => [cell.estimator, cell.rmse[0], cell.variance[0], cell.lookups, cell.null_collisions])}};
}

const kScalingModes = {
  ns_per_sample: {text: "ns a sample", y: (point) => point.ns_per_sample && point.ns_per_sample.value, bars: (point) => point.ns_per_sample, exponent: "exponent"},
  lookups: {text: "lookups a sample", y: (point) => point.lookups, bars: () => null, exponent: "exponent_lookups"},
};

/// Cost over one parameter, all else being equal.
function scalingPlot(series, axis, mode) {
  const kind = kScalingModes[mode];
  const shown = series.filter((one) => one.axis === axis && one.points.some((point) => kind.y(point) > 0));
  return {
    data: shown.map((one, i) => {
      const points = one.points.filter((point) => kind.y(point) > 0), style = styles.get(one.estimator) || {colour: kColours[i % kColours.length], symbol: kSymbols[i % kSymbols.length], dash: "solid"};
      const exponent = one[kind.exponent];
      return {
        type: "scatter", mode: "lines+markers", name: `${one.estimator} (${exponent ? exponent.value.toFixed(2) : "–"})`, x: points.map((p) => p.x), y: points.map(kind.y), error_y: errorBars(points.map(kind.bars)),
        line: {color: style.colour, dash: style.dash, width: 1.5}, marker: {color: style.colour, symbol: style.symbol, size: 7},
        hovertemplate: `${plain(one.estimator)}<br>${plain(one.rest)}<br>${axis} %{x}<br>${kind.text} %{y:.3g}<extra></extra>`,
      };
    }),
    layout: {xaxis: logAxis(axis), yaxis: logAxis(kind.text)},
    numbers: {heads: [["estimator"], ["all else"], "exponent", "low", "high"], rows: shown.map((one) => { const e = one[kind.exponent]; return [one.estimator, one.rest, e && e.value, e && e.low, e && e.high]; })},
  };
}

/// Plotly's name of the n-th of its axes.
function numbered(name, n) {
  return n === 1 ? name : `${name}${n}`;
}

/// Plotly takes text as HTML.
function plain(text) {
  return text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/%\{/g, "% {");
}

/// A scene's name without the folders of its files.
function sceneLabel(name) {
  return name.replace(/file:[^|]*?([^/|]+\.vdb)/g, "$1");
}

/// What tells scenes apart: the parts of their names that are not the same in all.
function distinctParts(names) {
  const parts = names.map((name) => sceneLabel(name).split(" | "));
  if (parts.length < 2) return parts;
  const differs = (p) => parts.some((one) => one[p] !== parts[0][p]);
  return parts.map((one) => one.filter((_, p) => differs(p)));
}

/// Plotly 2.6 has no text in heat maps.
function written(ratios, x, lines) {
  const most = Math.max(...ratios.flat());
  return ratios.flatMap((row, r) => row.flatMap((ratio, c) => (ratio === null ? [] : [{
    x: x[c], y: lines[r].name, text: shortNumber(ratio), showarrow: false, font: {size: 10, color: Math.log(ratio) > Math.log(most) / 2 ? "#ffffff" : "#000000"},
  }])));
}
