// The data, and what of it the filters let through.

const report = JSON.parse(unpackedData);
unpackedData = "";

const facets = [
  { key: "estimator", title: "Estimators", hidden: new Set() },
  { key: "medium", title: "Media", hidden: new Set() },
  { key: "quantity", title: "Quantities", hidden: new Set() },
];

/** The scene that sections show where there are too many to show all. */
let chosenScene = 0;

/** As many scenes are shown side by side; of more, one at a time. */
const fewScenes = 4;

function nameThings() {
  report.cells.forEach((cell, index) => Object.assign(cell, { index, label: cell.estimator }));
  const experiments = report.scenes.map(({ ranking }) => [...new Set(ranking.map(({ cell }) => report.cells[cell].experiment))].sort().join(" + "));
  const names = shortSceneNames(report.scenes, experiments);
  report.scenes.forEach((scene, index) => {
    Object.assign(scene, { index, short: names[index], experiment: experiments[index] });
    for (const entry of scene.ranking) report.cells[entry.cell].label = entry.label;
  });
}
nameThings();

function valuesOf(facet) {
  return [...new Set(report.cells.map((cell) => cell[facet.key]))].sort();
}

function passes(cell) {
  return facets.every((facet) => !facet.hidden.has(cell[facet.key]));
}

function passingCells() {
  return report.cells.filter(passes);
}

/** Cells of a scene in the order of their ranks. */
function cellsOf(scene) {
  return scene.ranking.map((entry) => report.cells[entry.cell]).filter(passes);
}

function scenesWith(hasSomething) {
  return report.scenes.filter((scene) => cellsOf(scene).some(hasSomething));
}

function hasCostAndTime(cell) {
  return Boolean(cell.cost && cell.time?.ns_per_sample);
}

/** Errors below are rounding; a scale that shows them shows nothing else. */
const rounding = 1e-10;

/** A tracker's samples may all be equal and all be wrong. */
function hasNoNoise(cell) {
  return cell.cost.variance.value === 0;
}

function isExact(cell) {
  return hasNoNoise(cell) && (cell.cost.floor === null || cell.cost.floor.high === 0);
}

function measurementOf(cell) {
  return cell.scene === null ? "" : report.scenes[cell.scene].measurement;
}

/** Claimed, and not disproven by the verdict. */
function standsUnbiased(cell) {
  return cell.unbiased;
}

/** The error that no number of samples removes, as far as noise lets it be seen; empty where there is none. */
function floorText(cell) {
  const floor = cell.cost?.floor;
  if (!floor || floor.high === 0) return "";
  return floor.low > 0 ? formatPercent(floor.value) : `< ${formatPercent(floor.high)}`;
}

function labelWithFloor(cell) {
  const floor = floorText(cell);
  return floor ? `${cell.label}, floor ${floor}` : cell.label;
}

const anythingTimed = report.cells.some((cell) => isNumber(cell.time?.ns_per_sample?.value));

function hasImages(cell) {
  return cell.images !== null;
}

function secondsTo(cell, target) {
  return cell.cost?.seconds[target] ?? null;
}

/** The mark of a time to an error that may not be reached; the notes of the scenes say why. */
function unprovenMark(time) {
  return time && time.reached !== false && time.proven === false ? "*" : "";
}

/** What stands below such marks, outside the rankings. */
function unprovenHint(times) {
  return times.some((time) => unprovenMark(time) !== "") ? "* this error may not be reached: the rankings say why." : "";
}

/** The word that `nullmark check` counts a cell by. */
function outcomeOf(cell) {
  return cell.word;
}
