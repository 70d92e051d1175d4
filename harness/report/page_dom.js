// Elements of the page.  Text is only ever set as text: results files may be hostile.

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "dataset") Object.assign(made.dataset, value);
    else if (name in made && name !== "role") made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

function button(text, onclick, properties = {}) {
  return element("button", { type: "button", onclick, ...properties }, text);
}

/** Text whose full precision is kept beside it. */
function numberSpan(value, format = formatNumber, dataset = {}) {
  return element("span", { className: "number", dataset: { ...dataset, value: String(value) } }, format(value));
}

/** A value, with a mark behind it and its interval below. */
function intervalText(interval, format = (x) => formatNumber(x, 3), mark = "") {
  const text = formatInterval(interval, format);
  const at = text.indexOf(" [");
  if (at < 0) return text + mark;
  return element("span", {}, text.slice(0, at) + mark, element("small", { className: "ends" }, text.slice(at + 1)));
}

/** Long labels break after their slashes. */
function breakable(text) {
  const parts = text.split("/").flatMap((part, i) => (i === 0 ? [part] : ["/", element("wbr"), part]));
  return element("span", {}, ...parts);
}

function selectOf(label, options, onchange) {
  const select = element("select", { onchange: () => onchange(select.value) });
  setOptions(select, options);
  return { select, label: element("label", { className: "choice" }, `${label} `, select) };
}

function setOptions(select, options) {
  const chosen = select.value;
  select.replaceChildren(...options.map(([value, text]) => element("option", { value }, text)));
  if (options.some(([value]) => value === chosen)) select.value = chosen;
}

function details(summary, ...children) {
  return element("details", {}, element("summary", {}, summary), ...children);
}

function tableRow(cells, tag = "td") {
  return element("tr", {}, ...cells.map((cell) => (cell instanceof HTMLTableCellElement ? cell : element(tag, {}, cell))));
}

function headRow(headings) {
  return element("thead", {}, tableRow(headings.map((text) => element("th", { scope: "col" }, text))));
}

function plainTable(headings, rows) {
  const body = element("tbody", {}, ...rows.map((row) => tableRow(row)));
  return inScroller(element("table", {}, headRow(headings), body));
}

/** A wide table scrolls in a box of its own, which the keyboard reaches. */
function inScroller(table) {
  return element("div", { className: "scroller", tabIndex: 0, role: "region", "aria-label": "Table" }, table);
}

/** A table that is made only when someone looks at it. */
function numbersDetails(makeTable) {
  const made = details("Numbers");
  made.classList.add("numbers");
  made.addEventListener("toggle", () => {
    if (made.open && made.childElementCount === 1) made.append(makeTable());
  });
  return made;
}
