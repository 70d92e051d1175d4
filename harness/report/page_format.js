"use strict";

// Numbers and names as text.

const unknown = "–";

function withMinusSign(text) {
  return text.replaceAll("-", "−");
}

function isNumber(x) {
  return typeof x === "number" && Number.isFinite(x);
}

/** The interval of a number that is known exactly. */
function exactly(x) {
  return isNumber(x) ? { value: x, low: x, high: x } : null;
}

function formatNumber(x, digits = 4) {
  if (!isNumber(x)) return unknown;
  if (x === 0) return "0";
  const size = Math.abs(x);
  const plain = size >= 1e-3 && size < 1e6;
  return withMinusSign(plain ? String(Number(x.toPrecision(digits))) : x.toExponential(digits - 1));
}

/** The ends of an interval; a missing end is unbounded. */
function formatEnds(interval, format) {
  const end = (x) => (isNumber(x) ? format(x) : "∞");
  return `[${end(interval.low)}, ${end(interval.high)}]`;
}

function formatInterval(interval, format = (x) => formatNumber(x, 3)) {
  if (!interval || !isNumber(interval.value)) return unknown;
  if (interval.low === interval.high) return format(interval.value);
  return `${format(interval.value)} ${formatEnds(interval, format)}`;
}

/** "22 %"; the space does not break. */
function formatPercent(share, digits = 2) {
  return `${formatNumber(100 * share, digits)}\u00a0%`;
}

/** Numbers in a configuration's words as the page writes its own: "-.95" becomes "−0.95". */
function withPageNumbers(text) {
  return text.replace(/(^|[^\d.])\.(?=\d)/g, "$10.").replace(/(^|[\s(=])-(?=\d)/g, "$1−");
}

function formatSeconds(x) {
  if (!isNumber(x)) return unknown;
  const units = [[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]];
  const [scale, unit] = units.find(([size]) => x >= size) ?? units[units.length - 1];
  return `${formatNumber(x / scale, 3)} ${unit}`;
}

/** Folders of volumes say nothing about the medium. */
function shortMedium(label) {
  return label.replace(/(?:vdb\/)?file:[^|]*?([^/|]+\.n?vdb)/, "$1");
}

/** Names of scenes, which begin with their experiments, without the parts that all of them share. */
function shortSceneNames(scenes, experiments) {
  const parts = scenes.map((scene) => scene.name.split(" | "));
  const differs = (place) => parts.some((name) => name[place] !== parts[0][place]);
  const several = new Set(experiments).size > 1;
  return parts.map((name, scene) => {
    const own = name.filter((_, place) => differs(place)).map(shortMedium);
    const rest = own.length > 0 ? own.join(" · ") : shortMedium(name.join(" · "));
    return several ? `${experiments[scene]}: ${rest}` : rest;
  });
}

function shortened(text, length) {
  return text.length <= length ? text : `${text.slice(0, length - 1)}…`;
}

/** The same of names that differ at their ends. */
function shortenedInside(text, length) {
  if (text.length <= length) return text;
  const end = Math.ceil(0.6 * (length - 1));
  return `${text.slice(0, length - 1 - end)}…${text.slice(-end)}`;
}

/** Text for plotly.js, which reads a subset of HTML. */
function plotText(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;");
}

function plotLines(lines) {
  return lines.map(plotText).join("<br>");
}

/** "a, b and 3 more trackers". */
function listed(names, most = 4, noun = "") {
  const rest = names.length - most;
  const more = () => (noun === "" ? `${rest} more` : countOf(rest, `more ${noun}`));
  return names.slice(0, most).join(", ") + (rest > 0 ? ` and ${more()}` : "");
}

function countOf(number, noun) {
  return `${number} ${noun}${number === 1 ? "" : "s"}`;
}
