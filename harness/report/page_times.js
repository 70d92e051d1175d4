// Time to an error, tracker by tracker: the first plot of a page that was timed.

function reachesTheError(cell) {
  const time = secondsTo(cell, 0);
  return Boolean(time?.reached && isNumber(time.value) && time.value > 0);
}

function timeTrace(cell, row, theme) {
  const style = styleOf(cell.label, theme);
  const time = secondsTo(cell, 0);
  return {
    type: "scatter",
    mode: "markers",
    x: [time.value],
    y: [row],
    error_x: errorBars([time], style),
    marker: { color: style.colour, symbol: style.symbol, size: 10 },
    hoverinfo: "text",
    text: [plotLines([labelWithFloor(cell), `${formatInterval(time, formatSeconds)}${unprovenMark(time)}`, cell.marked_word])],
    showlegend: false,
  };
}

/** At most three ticks, which a narrow plot has room for. */
function fewTicks(low, high) {
  const decades = Array.from({ length: Math.ceil(Math.log10(high / low)) + 2 }, (_, k) => 10 ** (Math.floor(Math.log10(low)) + k));
  const inside = (ticks) => ticks.map((x) => Number(x.toPrecision(12))).filter((x) => x >= low / 1.1 && x <= 1.1 * high);
  const candidates = [inside(decades), inside(decades.flatMap((x) => [x, 2 * x, 5 * x])), high > low ? roundTicks(low, high) : [low]];
  const ticks = candidates.find(({ length }) => length > 1) ?? [low];
  return ticks.filter((_, k) => k % Math.ceil(ticks.length / 3) === 0);
}

function narrowTimeAxis(theme, ends) {
  const ticks = fewTicks(Math.min(...ends), Math.max(...ends));
  return axis(theme, "time of a ray", { type: "log", tickangle: 0, tickmode: "array", tickvals: ticks, ticktext: ticks.map(formatSeconds) });
}

function timesPlot(scene, width, theme) {
  const cells = cellsOf(scene).filter(reachesTheError).sort((a, b) => secondsTo(a, 0).value - secondsTo(b, 0).value);
  const rows = cells.map((_, row) => row);
  const ends = cells.flatMap((cell) => [secondsTo(cell, 0).low, secondsTo(cell, 0).value, secondsTo(cell, 0).high]).filter((x) => isNumber(x) && x > 0);
  const narrow = width < 620;
  const claim = (cell) => (narrow || claimTag(cell) === null ? "" : ` (${cell.claims})`);
  const name = (cell) => plotText(`${shortenedInside(cell.label, narrow ? 22 : 60)}${claim(cell)}${unprovenMark(secondsTo(cell, 0))} ${markOf(cell)}`);
  return {
    traces: cells.map((cell, row) => timeTrace(cell, row, theme)),
    layout: {
      ...baseLayout(theme),
      height: 80 + 21 * cells.length,
      xaxis: narrow ? narrowTimeAxis(theme, ends) : logAxis(theme, "seconds a ray until the error is 1\u00a0%", ends),
      yaxis: { ...axis(theme, ""), tickmode: "array", tickvals: rows, ticktext: cells.map(name), range: [cells.length - 0.4, -0.6] },
    },
  };
}

/** ", 0.29 times the time of ratio": of the fastest cell, against the plain tracker that everyone knows. */
function againstRatio(scene, cell) {
  const ratios = cellsOf(scene).filter((other) => other.type === "ratio" && reachesTheError(other));
  // Of several results the one that was measured with the cell.
  const ratio = ratios.find(({ run }) => run === cell.run) ?? ratios[0];
  if (!ratio || ratio.estimator === cell.estimator || !reachesTheError(cell)) return "";
  return `, ${formatNumber(secondsTo(cell, 0).value / secondsTo(ratio, 0).value, 2)} times the time of ${ratio.label}`;
}

/** Who is the fastest that claims to be unbiased, what that costs, and what is proven of it. */
function answerOf(scene) {
  const said = ({ cell: place, split }) => {
    const cell = report.cells[place];
    const others = split ? `; not all results of ${cell.estimator} have this rank` : "";
    return `${cell.label} (${formatSeconds(secondsTo(cell, 0).value)}${againstRatio(scene, cell)}; ${cell.marked_word}${others})`;
  };
  const each = entriesByTracker(unbiasedWinnersOf(scene)).map((own) => own.map(said).join(", measured again as "));
  return each.length === 0 ? "" : `Fastest that claims to be unbiased: ${each.join(", tied with ")}.`;
}

function timesCaption(scene) {
  const never = cellsOf(scene).filter((cell) => secondsTo(cell, 0)?.reached === false && hasCostAndTime(cell));
  return [
    answerOf(scene),
    `${marksMeaning(cellsOf(scene).filter(reachesTheError))}.`,
    never.length > 0 ? `Never, because of a bias that no number of samples removes: ${listed(never.map(labelWithFloor))}.` : "",
    cellsOf(scene).some((cell) => unprovenMark(secondsTo(cell, 0))) ? `* ${scene.unproven}.` : "",
  ].filter(Boolean).join(" ");
}

function timesNumbers(scene) {
  const rows = cellsOf(scene).filter(hasCostAndTime).map((cell) => [markedLabel(cell.label), reachedText(cell, 0), cellBadge(cell)]);
  return plainTable(["estimator", "seconds a ray to 1\u00a0%", "verdict"], rows);
}

function timesFigure(scene) {
  return {
    title: scene.short,
    caption: timesCaption(scene),
    height: 80 + 21 * cellsOf(scene).filter(reachesTheError).length,
    describe: (width, theme) => timesPlot(scene, width, theme),
    numbers: () => timesNumbers(scene),
  };
}

function buildTimes(body) {
  return scenePanels(body, reachesTheError, (panel, scene) => addFigure(panel, timesFigure(scene)));
}
