// The filters of the whole page.

function facetChecks(facet, onchange) {
  return valuesOf(facet).map((value) => {
    const check = element("input", { type: "checkbox", checked: true, value });
    check.onchange = () => {
      if (check.checked) facet.hidden.delete(value);
      else facet.hidden.add(value);
      onchange();
    };
    const text = facet.key === "medium" ? shortMedium(value) : value;
    return element("label", { title: value }, check, ` ${text}`);
  });
}

function setAll(facet, list, checked) {
  for (const check of list.querySelectorAll("input")) {
    check.checked = checked;
    if (checked) facet.hidden.delete(check.value);
    else facet.hidden.add(check.value);
  }
}

function facetHeading(facet) {
  const all = valuesOf(facet).length;
  const shown = all - facet.hidden.size;
  return `${facet.title} (${shown === all ? all : `${shown} of ${all}`})`;
}

function facetBox(facet, onchange) {
  const summary = element("summary", {}, facetHeading(facet));
  const changed = () => {
    summary.textContent = facetHeading(facet);
    onchange();
  };
  const list = element("div", { className: "checks", role: "group", "aria-label": facet.title }, ...facetChecks(facet, changed));
  const choose = (checked) => () => {
    setAll(facet, list, checked);
    changed();
  };
  const buttons = element("div", { className: "controls" }, button("All", choose(true)), button("None", choose(false)));
  return element("details", { className: "facet", dataset: { facet: facet.key } }, summary, buttons, list);
}

function buildFilters(onchange) {
  const place = document.getElementById("facets");
  place.append(...facets.filter((facet) => valuesOf(facet).length > 1).map((facet) => facetBox(facet, onchange)));
  document.getElementById("filters").hidden = place.childElementCount === 0;
}

function tellFiltered() {
  const shown = passingCells().length;
  const all = report.cells.length;
  document.getElementById("filtered").textContent = shown === all ? `All ${all} cells` : `${shown} of ${all} cells`;
}
