// The configuration's tables, with the pictures of their cells.

const thumbnailKinds = ["mean", "error", "variance", "lookups"].map((name) => imageKinds[name]);

function cellsOfTable(table) {
  const places = table.rows.flatMap((row) => row.cells).filter((place) => place !== null);
  return [...new Set(places)].map((place) => report.cells[place]);
}

function columnsWithImages(table) {
  const hasOne = (column) => table.rows.some((row) => row.cells[column] !== null && hasImages(report.cells[row.cells[column]]));
  return table.columns.map((_, column) => column).filter(hasOne);
}

function thumbnailRanges(cells) {
  const shown = cells.filter(hasImages);
  return new Map([...thumbnailKinds, imageKinds.reference].map((kind) => {
    const light = kind.colours === greys && shown.some(imageKinds.reference.of);
    return [kind, light ? lightRange(shown) : sharedRange(kind, shown)];
  }));
}

function measurementsOf(table, column) {
  const cells = table.rows.map((row) => row.cells[column]).filter((place) => place !== null).map((place) => report.cells[place]);
  return [...new Set(cells.map(measurementOf))].filter((text) => text !== "").join("; ");
}

function tableHead(table, pictured) {
  const top = [
    element("th", { scope: "col", rowSpan: 2 }, table.metric),
    ...table.columns.map((name) => element("th", { scope: "col", rowSpan: 2, className: "numeric" }, name)),
    ...(pictured.length > 0 ? [element("th", { scope: "col", rowSpan: 2 }, "reference")] : []),
    ...pictured.map((column) => {
      const measured = measurementsOf(table, column);
      return element("th", { scope: "colgroup", className: "group" }, table.columns[column], measured ? element("small", {}, ` ${measured}`) : "");
    }),
  ];
  const kinds = pictured.map(() => element("th", { className: "kinds" }, ...thumbnailKinds.map((kind) => element("span", {}, kind.title))));
  return element("thead", {}, tableRow(top), pictured.length > 0 ? tableRow(kinds) : null);
}

/** A number that the configuration gives, as it has it: a published one keeps its digits. */
function formatGiven(x) {
  return isNumber(x) ? withMinusSign(String(x)) : unknown;
}

function tableValue(table, row, column) {
  const place = row.cells[column];
  const cell = place === null ? null : report.cells[place];
  const value = element("td", { className: "numeric" }, numberSpan(row.values[column], column < table.given ? formatGiven : formatNumber, { key: "table", column: String(column) }));
  if (cell && cell.estimator !== cell.type) value.title = cell.estimator;
  return value;
}

/** The pictures of a row's cell, with the bias that makes its errors differ from noise. */
function pictureCell(place, ranges) {
  const cell = place === null ? null : report.cells[place];
  if (!cell || !hasImages(cell)) return element("td", { className: "pictures" });
  const pictures = thumbnailKinds.map((kind) => thumbnail(cell, kind, ranges.get(kind)));
  const bias = `bias ${cell.bias.map((x) => formatNumber(x, 2)).join(", ")}`;
  return element("td", { className: "pictures" }, element("div", {}, ...pictures), element("small", {}, `${cell.label}: ${bias}`));
}

function referenceCell(row, ranges) {
  const place = row.cells.find((candidate) => candidate !== null && hasImages(report.cells[candidate]));
  const picture = place === undefined ? null : thumbnail(report.cells[place], imageKinds.reference, ranges.get(imageKinds.reference));
  return element("td", { className: "pictures" }, element("div", {}, picture ?? ""));
}

function rowOfTable(table, row, index, pictured, ranges) {
  const note = row.note ? element("small", { className: "note" }, withPageNumbers(row.note)) : null;
  const hasPictures = pictured.some((column) => row.cells[column] !== null && hasImages(report.cells[row.cells[column]]));
  const pictures = hasPictures
    ? [referenceCell(row, ranges), ...pictured.map((column) => pictureCell(row.cells[column], ranges))]
    : pictured.length > 0 ? [element("td", { colSpan: 1 + pictured.length }, note ?? "")] : [];
  const cells = [
    element("th", { scope: "row" }, withPageNumbers(row.label), hasPictures || pictured.length === 0 ? note : null),
    ...table.columns.map((_, column) => tableValue(table, row, column)),
    ...pictures,
  ];
  const made = tableRow(cells);
  made.dataset.row = String(index);
  return made;
}

function tableFigure(table, index) {
  const pictured = columnsWithImages(table);
  const ranges = pictured.length > 0 ? thumbnailRanges(cellsOfTable(table)) : new Map();
  const rows = table.rows.map((row, place) => rowOfTable(table, row, place, pictured, ranges));
  const made = element("table", { className: "comparison", dataset: { table: String(index) } }, tableHead(table, pictured), element("tbody", {}, ...rows));
  return { made: inScroller(made), ranges };
}

function tableKeys(ranges) {
  if (ranges.size === 0) return null;
  const keys = thumbnailKinds.map((kind) => scaleKey(kind, ranges.get(kind)));
  const reading = "Colour that fills an error picture is bias; specks of both colours are noise. Pictures of a kind share one scale:";
  return element("p", { className: "keys" }, reading, ...keys);
}

function buildTables(body) {
  report.tables.forEach((table, index) => {
    const { made, ranges } = tableFigure(table, index);
    body.append(element("h3", {}, withPageNumbers(table.title)), made, tableKeys(ranges) ?? "");
  });
  return () => {};
}
