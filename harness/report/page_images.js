// Pictures: small ones beside tables, maps of cost, strips of an estimate beside its reference.

const decodedImages = new Map();

/** Rows of a picture, the lowest first; what is not finite is NaN. */
function decodedImage(place) {
  if (!decodedImages.has(place)) decodedImages.set(place, decodeImage(report.images[place]));
  return decodedImages.get(place);
}

function decodeImage({ width, height, low, high, data }) {
  const bytes = atob(data);
  const rows = [];
  for (let y = 0; y < height; ++y) {
    const row = new Float64Array(width);
    for (let x = 0; x < width; ++x) {
      const at = 2 * (y * width + x);
      const k = bytes.charCodeAt(at) + 256 * bytes.charCodeAt(at + 1);
      row[x] = k === 65535 ? NaN : low + ((high - low) * k) / 65534;
    }
    rows.push(row);
  }
  return { width, height, low, high, rows };
}

/** A picture made of two, pixel by pixel. */
function combined(a, b, combine) {
  const rows = a.rows.map((row, y) => row.map((value, x) => combine(value, b.rows[y][x])));
  let [low, high] = [Infinity, -Infinity];
  for (const row of rows) {
    for (const value of row) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return { width: a.width, height: a.height, rows, low, high };
}

const combinedImages = new Map();

function combinedOnce(kind, cell, make) {
  const key = `${kind} ${cell.index}`;
  if (!combinedImages.has(key)) combinedImages.set(key, make());
  return combinedImages.get(key);
}

function imageNamed(name) {
  return (cell) => (cell.images && name in cell.images ? decodedImage(cell.images[name]) : null);
}

function combinedOf(kind, first, second, combine) {
  return (cell) => {
    const [a, b] = [imageNamed(first)(cell), imageNamed(second)(cell)];
    if (!a || !b || a.width !== b.width || a.height !== b.height) return null;
    return combinedOnce(kind, cell, () => combined(a, b, combine));
  };
}

const imageKinds = {
  reference: { title: "reference", of: imageNamed("reference"), colours: greys },
  mean: { title: "estimate", of: imageNamed("mean"), colours: greys },
  error: { title: "signed error", of: combinedOf("error", "mean", "reference", (a, b) => a - b), colours: blueToOrange, signed: true },
  variance: { title: "variance", of: imageNamed("variance"), colours: cividis },
  variance_theory: { title: "variance, theory", of: imageNamed("variance_theory"), colours: cividis },
  lookups: { title: "lookups", of: imageNamed("lookups"), colours: viridis },
  null_collisions: { title: "null collisions", of: imageNamed("null_collisions"), colours: viridis },
  product: { title: "variance × lookups", of: combinedOf("product", "variance", "lookups", (a, b) => a * b), colours: cividis },
};

/** The range of values that holds all the pictures; around 0 where signs count. */
function rangeOf(kind, images) {
  const low = Math.min(...images.map((image) => image.low));
  const high = Math.max(...images.map((image) => image.high));
  if (!kind.signed) return { low, high: high > low ? high : low + 1 };
  const most = Math.max(-low, high) || 1;
  return { low: -most, high: most };
}

function sharedRange(kind, cells) {
  return rangeOf(kind, cells.map(kind.of).filter(Boolean));
}

/** Reference and estimate are of one kind of value, and a wild estimate must not darken the reference. */
function lightRange(cells) {
  return sharedRange(imageKinds.reference, cells);
}

// Small pictures.

function channelsOf(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
}

/** 256 colours as the opaque pixels of a canvas. */
function paletteOf(colours) {
  const stops = colours.map(channelsOf);
  const pixels = new Uint8ClampedArray(4 * 256).fill(255);
  for (let i = 0; i < 256; ++i) {
    const place = (i / 255) * (stops.length - 1);
    const below = Math.min(Math.floor(place), stops.length - 2);
    for (let c = 0; c < 3; ++c) pixels[4 * i + c] = stops[below][c] + (stops[below + 1][c] - stops[below][c]) * (place - below);
  }
  return new Uint32Array(pixels.buffer);
}

const palettes = new Map();

function paletteFor(kind) {
  if (!palettes.has(kind)) palettes.set(kind, paletteOf(kind.colours));
  return palettes.get(kind);
}

function paintPixels(canvas, image, kind, range) {
  const palette = paletteFor(kind);
  const picture = new ImageData(image.width, image.height);
  const pixels = new Uint32Array(picture.data.buffer);
  const scale = 255 / (range.high - range.low);
  image.rows.forEach((row, y) => {
    const start = (image.height - 1 - y) * image.width;
    for (let x = 0; x < image.width; ++x) {
      const shade = Math.round((row[x] - range.low) * scale);
      if (!Number.isNaN(shade)) pixels[start + x] = palette[Math.min(255, Math.max(0, shade))];
    }
  });
  canvas.getContext("2d").putImageData(picture, 0, 0);
}

function thumbnail(cell, kind, range) {
  const image = kind.of(cell);
  if (!image) return null;
  const canvas = element("canvas", { width: image.width, height: image.height, role: "img" });
  const text = `${kind.title} of ${cell.label}: from ${formatNumber(image.low, 3)} to ${formatNumber(image.high, 3)}`;
  canvas.setAttribute("aria-label", text);
  canvas.title = text;
  paintPixels(canvas, image, kind, range);
  return canvas;
}

function gradientOf(kind) {
  return `linear-gradient(to right, ${kind.colours.join(", ")})`;
}

/** The scale of small pictures. */
function scaleKey(kind, range) {
  const bar = element("span", { className: "bar", "aria-hidden": "true" });
  bar.style.background = gradientOf(kind);
  return element("span", { className: "key" }, `${kind.title} ${formatNumber(range.low, 2)} `, bar, ` ${formatNumber(range.high, 2)}`);
}

// Large pictures, by plotly.js.

function logOf(image) {
  return image.rows.map((row) => row.map((value) => (value > 0 ? Math.log10(value) : NaN)));
}

function leastPositive(images) {
  let least = Infinity;
  for (const image of images) for (const row of image.rows) for (const value of row) if (value > 0 && value < least) least = value;
  return least;
}

/** The range of a shared scale; logarithmic ones span at most six decades. */
function logRange(images) {
  const high = Math.log10(Math.max(...images.map((image) => image.high)));
  const low = Math.log10(leastPositive(images));
  if (!Number.isFinite(high) || !Number.isFinite(low)) return { low: 0, high: 1 };
  return { low: Math.max(low, high - 6), high: high > low ? high : low + 1 };
}

function logTicks({ low, high }) {
  const step = Math.max(1, Math.ceil((high - low) / 4));
  const exponents = [];
  for (let exponent = Math.ceil(low); exponent <= high; exponent += step) exponents.push(exponent);
  if (exponents.length >= 2) return { tickvals: exponents, ticktext: exponents.map((e) => `10<sup>${withMinusSign(String(e))}</sup>`) };
  return { tickvals: [low, high], ticktext: [low, high].map((e) => formatNumber(10 ** e, 2)) };
}

/**
 * Pixels stay sharp where the screen has room for them; where not, in-between values are six times as fast.  ("fast" would cut
 * such pictures off in plotly.js 2.6.)
 */
function pictureTrace(tile, place, crowded, colorbar) {
  const { image, kind, range, logarithmic } = tile;
  const suffix = place === 0 ? "" : String(place + 1);
  return {
    type: "heatmap",
    z: logarithmic ? logOf(image) : image.rows,
    customdata: image.rows,
    x0: 0.5 / image.width,
    dx: 1 / image.width,
    y0: 0.5 / image.height,
    dy: 1 / image.height,
    zmin: range.low,
    zmax: range.high,
    zsmooth: crowded ? "best" : false,
    colorscale: plotlyScale(kind.colours),
    xaxis: `x${suffix}`,
    yaxis: `y${suffix}`,
    hovertemplate: `${plotText(kind.title)} %{customdata:.4g}<br>at %{x:.3f}, %{y:.3f}<extra></extra>`,
    colorbar,
  };
}

function pictureAxis(theme, domain, anchor) {
  return {
    domain, anchor, range: [0, 1], showgrid: false, zeroline: false, showticklabels: false,
    ticks: "", showline: true, mirror: true, linecolor: theme.muted, linewidth: 0.5,
  };
}

/** Where the tiles of a figure go, as shares of its size. */
function tilePlaces(count, columns, width, aspect, headings) {
  const across = width / columns;
  const barWidth = 52;
  const picture = across - barWidth;
  const down = picture * aspect + headings;
  const rows = Math.ceil(count / columns);
  const height = rows * down + 6;
  const places = Array.from({ length: count }, (_, i) => {
    const left = (i % columns) * across;
    const top = Math.floor(i / columns) * down + headings;
    return { x: [left / width, (left + picture) / width], y: [1 - (top + picture * aspect) / height, 1 - top / height] };
  });
  return { places, height };
}

function tileHeading(tile, place, theme) {
  return {
    text: plotLines(tile.heading), align: "left", x: place.x[0], y: place.y[1], xref: "paper", yref: "paper", xanchor: "left", yanchor: "bottom",
    showarrow: false, font: { size: 11, color: theme.ink },
  };
}

function tileBar(tile, place, theme) {
  return {
    x: place.x[1] + 0.004, xpad: 0, xanchor: "left", y: (place.y[0] + place.y[1]) / 2, len: place.y[1] - place.y[0], ypad: 0,
    thickness: 8, outlinewidth: 0, tickfont: { size: 9, color: theme.muted }, nticks: 4, tickformat: ".3~g",
    ...(tile.logarithmic ? logTicks(tile.range) : {}),
  };
}

/** Pixels without a value on their scale: not finite, or zero on a logarithmic one. */
const noValueGrey = "#9a9a9a";

function picturesPlot(tiles, columns, width, theme) {
  const { image } = tiles[0];
  const across = width < 620 ? Math.min(2, columns) : columns;
  const headings = 4 + 14 * tiles[0].heading.length;
  const { places, height } = tilePlaces(tiles.length, across, width, image.height / image.width, headings);
  const layout = { ...baseLayout(theme), height, margin: { l: 1, r: 0, t: 0, b: 0 }, annotations: [], plot_bgcolor: noValueGrey };
  const traces = tiles.map((tile, i) => {
    const suffix = i === 0 ? "" : String(i + 1);
    layout[`xaxis${suffix}`] = pictureAxis(theme, places[i].x, `y${suffix}`);
    layout[`yaxis${suffix}`] = pictureAxis(theme, places[i].y, `x${suffix}`);
    layout.annotations.push(tileHeading(tile, places[i], theme));
    const crowded = tile.image.width > (places[i].x[1] - places[i].x[0]) * width;
    return pictureTrace(tile, i, crowded, tileBar(tile, places[i], theme));
  });
  return { traces, layout };
}

const scaleChoices = {
  shared_log: { title: "one logarithmic scale for all estimators", shared: true, logarithmic: true },
  shared: { title: "one linear scale for all estimators", shared: true, logarithmic: false },
  own: { title: "a linear scale for each picture", shared: false, logarithmic: false },
};

function cellsWithImages(scene) {
  return cellsOf(scene).filter(hasImages);
}

/** The lines over a picture whose estimator is named elsewhere. */
function titleLine(kind) {
  return [kind.title];
}

function mapTiles(cell, cells, scales, heading) {
  const kinds = ["variance", "variance_theory", "lookups", "null_collisions", "product"].map((name) => imageKinds[name]).filter((kind) => kind.of(cell));
  return kinds.map((kind) => {
    const images = scales.shared ? cells.map(kind.of).filter(Boolean) : [kind.of(cell)];
    const range = scales.logarithmic ? logRange(images) : rangeOf(kind, images);
    return { kind, image: kind.of(cell), range, logarithmic: scales.logarithmic, heading: heading(kind) };
  });
}

function imageCaption(cell) {
  const figures = [["RMSE", cell.rmse], ["bias", cell.bias], ["variance", cell.variance]].map(
    ([name, values]) => `${name} ${values.map((x) => formatNumber(x, 3)).join(", ")}`);
  return `${figures.join("; ")}; ${formatNumber(cell.lookups, 3)} lookups a sample; ${countOf(cell.samples_per_ray, "sample")} a pixel.`;
}

function tileNumbers(tiles) {
  return plainTable(["picture", "least", "most"], tiles.map(({ kind, image }) => [kind.title, formatNumber(image.low), formatNumber(image.high)]));
}

function picturesFigure(scene, cell, tiles) {
  const zeros = tiles().filter(({ logarithmic, image }) => logarithmic && image.low <= 0).map(({ kind }) => kind.title);
  return {
    title: `${cell.label}: ${scene.short}`,
    caption: imageCaption(cell) + (zeros.length > 0 ? ` Grey: zero, which a logarithmic scale has not (${listed(zeros)}).` : ""),
    height: 230,
    describe: (width, theme) => picturesPlot(tiles(), tiles().length, width, theme),
    numbers: () => tileNumbers(tiles()),
  };
}

function buildMaps(body) {
  let scales = scaleChoices.shared_log;
  const choice = selectOf("Colours", Object.entries(scaleChoices).map(([key, { title }]) => [key, title]), (key) => {
    scales = scaleChoices[key];
    update();
  });
  const showScene = (panel, scene) => {
    const cells = cellsWithImages(scene);
    for (const cell of cells) addFigure(panel, picturesFigure(scene, cell, () => mapTiles(cell, cells, scales, titleLine)));
  };
  const update = scenePanels(body, hasImages, showScene, [choice.label]);
  return update;
}

function stripTiles(cell, cells, heading) {
  const kinds = ["reference", "mean", "error", "variance", "lookups"].map((name) => imageKinds[name]).filter((kind) => kind.of(cell));
  const light = imageKinds.reference.of(cell) ? lightRange(cells) : sharedRange(imageKinds.mean, [cell]);
  return kinds.map((kind) => {
    const range = kind.colours === greys ? light : rangeOf(kind, [kind.of(cell)]);
    return { kind, image: kind.of(cell), range, heading: heading(kind) };
  });
}

function buildStrips(body) {
  return scenePanels(body, hasImages, (panel, scene) => {
    const cells = cellsWithImages(scene);
    for (const cell of cells) addFigure(panel, picturesFigure(scene, cell, () => stripTiles(cell, cells, titleLine)));
  });
}
