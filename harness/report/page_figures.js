// `page.html?figures=1`: the main plots as files, for papers; `nullmark report --figures` takes them from the page.

const paperTheme = { ink: "#111111", muted: "#666666", paper: "#ffffff", grid: "#e2e2e2" };
const paperWidth = 900;
const mostScenes = 12;
const mostPictures = 8;

/** "pareto-profiles-2": what is drawn, the experiment, and which of its plots of that kind. */
function numberedNames() {
  const counts = new Map();
  return (text) => {
    const base = text.toLowerCase().replace(/[^a-z0-9]+/g, "-").slice(0, 60).replace(/^-|-$/g, "");
    counts.set(base, (counts.get(base) ?? 0) + 1);
    return `${base}-${counts.get(base)}`;
  };
}

function firstScenes(hasSomething) {
  return scenesWith(hasSomething).slice(0, mostScenes);
}

function convergencePaper() {
  const view = usefulConvergenceViews()[0]?.[1] ?? convergenceViews.time;
  const name = view === convergenceViews.time ? "error-over-time" : "error-over-lookups";
  const scenes = firstScenes((cell) => stepsOf(cell, view).length > 0);
  return scenes.map((scene) => ({ name: `${name} ${scene.experiment}`, caption: `${view.title}: ${scene.name}`, describe: convergenceFigure(scene, view).describe }));
}

function picturesPaper(scene, kind, tilesOf, columns) {
  const cells = cellsWithImages(scene).slice(0, mostPictures);
  const figures = (cell) => `, RMSE ${cell.rmse.map((x) => formatNumber(x, 3)).join(", ")}`;
  const named = (cell) => (picture) => [shortened(cell.label, 30), picture.title + (picture === imageKinds.mean ? figures(cell) : "")];
  const tiles = () => cells.flatMap((cell) => tilesOf(cell, cells, named(cell)));
  return { name: `${kind} ${scene.experiment}`, caption: `${kind}: ${scene.name}`, describe: (width, theme) => picturesPlot(tiles(), columns(cells[0]), width, theme) };
}

function scalingPaper() {
  const view = usefulScalingViews()[0]?.[1] ?? scalingViews.ns_per_sample;
  return scalingGroups(view).map((group) => ({ name: `scaling ${report.cells[group.series[0].points[0].cell].experiment}`, caption: `${view.title} over ${group.axis}: ${group.rest}`, describe: scalingFigure(group, view).describe }));
}

function paperFigures() {
  const maps = (cell, cells, heading) => mapTiles(cell, cells, scaleChoices.shared_log, heading);
  const withImages = firstScenes(hasImages);
  const matrix = usefulMatrixViews().slice(0, 1).map(([, view]) => ({ name: "matrix", caption: view.title, describe: matrixFigure(view).describe }));
  return [
    ...firstScenes(reachesTheError).map((scene) => ({ name: `time-to-error ${scene.experiment}`, caption: `Time to an error of 1 %: ${scene.name}`, describe: timesFigure(scene).describe })),
    ...convergencePaper(),
    ...firstScenes(hasParetoPoint).map((scene) => ({ name: `pareto ${scene.experiment}`, caption: `Variance and time of a sample: ${scene.name}`, describe: paretoFigure(scene).describe })),
    ...matrix,
    ...withImages.map((scene) => picturesPaper(scene, "maps", maps, (cell) => maps(cell, [cell], titleLine).length)),
    ...withImages.map((scene) => picturesPaper(scene, "strips", stripTiles, (cell) => stripTiles(cell, [cell], titleLine).length)),
    ...scalingPaper(),
  ];
}

async function drawnForPaper({ caption, describe }, name) {
  const { traces, layout } = describe(paperWidth, paperTheme);
  const figure = { data: traces, layout: { ...layout, width: paperWidth, paper_bgcolor: "#ffffff", plot_bgcolor: "#ffffff" } };
  const size = { width: paperWidth, height: layout.height };
  const svg = await Plotly.toImage(figure, { ...size, format: "svg", imageDataOnly: true });
  const png = await Plotly.toImage(figure, { ...size, format: "png", scale: 2, imageDataOnly: true });
  return { name, caption, svg, png, ...size };
}

async function writeFigures() {
  const nameOf = numberedNames();
  const drawn = [];
  for (const figure of paperFigures()) drawn.push(await drawnForPaper(figure, nameOf(figure.name)));
  const place = document.createElement("script");
  place.setAttribute("type", "application/json");
  place.setAttribute("id", "figures");
  place.textContent = JSON.stringify(drawn).replaceAll("<", "\\u003c");
  document.body.append(place);
  document.documentElement.dataset.ready = "figures";
}
