"use strict";

// Elements and numbers.  Text always goes in as text: results may come from anywhere.

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "on") for (const [event, action] of Object.entries(value)) made.addEventListener(event, action);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

function shortNumber(x) {
  if (x === null || x === undefined) return "–";
  if (x === 0) return "0";
  const digits = x.toPrecision(3);
  return Math.abs(x) >= 1e5 || Math.abs(x) < 1e-4 ? x.toExponential(2) : String(Number(digits));
}

function percent(x) {
  return `${shortNumber(100 * x)} %`;
}

/// "1.23 ±4 %", or the interval itself where it is wide.
function intervalText(interval) {
  if (!interval || interval.value === null) return "–";
  const {value, low, high} = interval;
  if (low === value && high === value) return shortNumber(value);
  if (low === null || high === null || value === 0) return `${shortNumber(value)} [${shortNumber(low)}, ${shortNumber(high)}]`;
  const half = Math.max(high / value - 1, 1 - low / value);
  return half < 0.5 ? `${shortNumber(value)} ±${Number((100 * half).toPrecision(2))} %` : `${shortNumber(value)} [${shortNumber(low)}, ${shortNumber(high)}]`;
}

/// A table's cell with the whole number behind it.
function numberCell(value, text = shortNumber(value), attributes = {}) {
  return element("td", {"data-value": value === null || value === undefined ? "" : String(value), ...attributes}, text);
}

function intervalCell(interval) {
  return numberCell(interval ? interval.value : null, intervalText(interval));
}

function textCell(text, attributes = {}) {
  return element("td", {class: "text", ...attributes}, text);
}

/// heads: [text, is text] or text.
function table(heads, rows, attributes = {}) {
  const head = element("tr", {}, ...heads.map((text) => element("th", {scope: "col", class: Array.isArray(text) ? "text" : ""}, Array.isArray(text) ? text[0] : text)));
  return element("div", {class: "scroll"}, element("table", attributes, element("thead", {}, head), element("tbody", {}, ...rows)));
}

/// The numbers of a picture, row by row from the lowest; null where one is not finite.
const decoded = new Map();
function pixels(image) {
  if (decoded.has(image)) return decoded.get(image);
  const bytes = atob(image.data);
  const rows = [];
  for (let y = 0, at = 0; y < image.height; ++y) {
    const row = new Array(image.width);
    for (let x = 0; x < image.width; ++x, at += 2) {
      const k = bytes.charCodeAt(at) + 256 * bytes.charCodeAt(at + 1);
      row[x] = k === 65535 ? null : image.low + ((image.high - image.low) * k) / 65534;
    }
    rows.push(row);
  }
  decoded.set(image, rows);
  return rows;
}

function combined(a, b, operation) {
  return a.map((row, y) => row.map((value, x) => (value === null || b[y][x] === null ? null : operation(value, b[y][x]))));
}

/// A small picture: 0 black, 1 white.
function thumbnail(image, title) {
  const canvas = element("canvas", {class: "thumb", width: image.width, height: image.height, role: "img", "aria-label": title, title});
  const context = canvas.getContext("2d");
  const shown = context.createImageData(image.width, image.height);
  pixels(image).forEach((row, y) => row.forEach((value, x) => {
    const at = 4 * ((image.height - 1 - y) * image.width + x);
    const grey = value === null ? 255 : Math.round(255 * Math.min(1, Math.max(0, value)));
    shown.data.set(value === null ? [255, 0, 255, 255] : [grey, grey, grey, 255], at);
  }));
  context.putImageData(shown, 0, 0);
  return canvas;
}
