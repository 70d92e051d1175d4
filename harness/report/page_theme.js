// Colours: the same estimator looks the same over the whole page, and never by its colour alone.

const okabeIto = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];
const symbols = [
  ["circle", "●"], ["square", "■"], ["diamond", "◆"], ["triangle-up", "▲"], ["triangle-down", "▼"], ["cross", "✚"],
  ["x", "✖"], ["star", "★"], ["circle-open", "○"], ["square-open", "□"], ["diamond-open", "◇"], ["triangle-up-open", "△"],
];
const dashes = ["solid", "dash", "dot", "dashdot", "longdash"];

const cividis = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];
const viridis = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const greys = ["#000000", "#ffffff"];
const blueToOrange = ["#053061", "#2166ac", "#67a9cf", "#d1e5f0", "#f7f7f7", "#fee0b6", "#f1a340", "#b35806", "#7f3b08"];

function plotlyScale(colours) {
  return colours.map((colour, i) => [i / (colours.length - 1), colour]);
}

const styleOfLabel = new Map();

/** These look the same in every report that has them. */
const commonTypes = ["delta", "ratio", "next_flight_delta", "next_flight_ratio", "residual_ratio", "ray_marching", "regular", "residual_delta"];

/** The colour of each type: its own where it is common; the others take those that no type of this report has, while there are any. */
function coloursOfTypes(labels) {
  const count = okabeIto.length + 1;
  const types = [...new Set(labels.map(([, type]) => type))].sort();
  const colours = new Map(types.filter((type) => commonTypes.includes(type)).map((type) => [type, commonTypes.indexOf(type) % count]));
  const free = Array.from({ length: count }, (_, i) => i).filter((i) => ![...colours.values()].includes(i));
  const others = types.filter((type) => !commonTypes.includes(type));
  others.forEach((type, i) => colours.set(type, i < free.length ? free[i] : (i - free.length) % count));
  return colours;
}

/** Types take colours, variants of a type symbols and dashes. */
function assignStyles() {
  const labels = [...new Map(report.cells.map((cell) => [cell.label, cell.type]))].sort(([a], [b]) => (a < b ? -1 : 1));
  const colours = coloursOfTypes(labels);
  const used = new Map();
  for (const [label, type] of labels) {
    const colour = colours.get(type);
    const look = used.get(colour) ?? 0;
    used.set(colour, look + 1);
    const [symbol, glyph] = symbols[(look + colour) % symbols.length];
    styleOfLabel.set(label, { colour: okabeIto[colour] ?? null, symbol, glyph, dash: dashes[look % dashes.length] });
  }
}
assignStyles();

/** Style of an estimator; the seventh colour is that of the text, which a dark page needs light. */
function styleOf(label, theme) {
  const style = styleOfLabel.get(label);
  return { ...style, colour: style.colour ?? theme.ink };
}

/** An estimator's name with the mark that it has in the plots. */
function markedLabel(label) {
  const style = styleOfLabel.get(label);
  const mark = element("span", { className: "mark", "aria-hidden": "true" }, style.glyph);
  mark.style.color = style.colour ?? "currentcolor";
  return element("span", { className: "estimator" }, mark, "\u00a0", breakable(label));
}

function currentTheme() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  return { ink: colour("--ink"), muted: colour("--muted"), paper: colour("--paper"), grid: colour("--line") };
}

function isDark() {
  return document.documentElement.dataset.theme === "dark";
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  document.getElementById("theme").textContent = name === "dark" ? "Light colours" : "Dark colours";
  redrawFigures();
}

function followTheme() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const follow = () => setTheme(dark.matches ? "dark" : "light");
  dark.addEventListener("change", follow);
  document.getElementById("theme").onclick = () => setTheme(isDark() ? "light" : "dark");
  follow();
}
