// Published claims, each with its verdict and the figures behind it.

const findingBadges = { reproduced: "PASS", refuted: "FAIL", "cannot tell": "INCONCLUSIVE" };

function findingBadge(finding) {
  return outcomeBadge(finding, findingBadges[finding]);
}

function claimVerdict(claim) {
  return element("span", {}, findingBadge(claim.finding), claim.required ? element("span", { className: "tag" }, "required") : null);
}

function findingTotals() {
  const counted = Object.keys(findingBadges).map((finding) => [finding, report.claims.filter((claim) => claim.finding === finding).length]);
  return element("p", { className: "totals" }, ...counted.map(([finding, count]) => outcomeBadge(`${count} ${finding}`, findingBadges[finding])));
}

function claimText(claim) {
  const note = claim.note ? element("small", { className: "aside" }, claim.note) : null;
  return element("span", {}, claim.claim, element("small", { className: "aside" }, claim.source), note);
}

/** One part in the claim's own row; of several, each with its own word. */
function claimFigures(claim) {
  const says = (part) => (part.says ? `${part.says}: ` : "");
  if (claim.parts.length === 1) return element("span", {}, says(claim.parts[0]), claim.parts[0].figures);
  return element("ul", { className: "parts" }, ...claim.parts.map((part) =>
    element("li", {}, findingBadge(part.finding), " ", says(part), part.figures)));
}

function buildClaims(body) {
  const rows = report.claims.map((claim) => [claim.id, claimVerdict(claim), claimText(claim), claimFigures(claim)]);
  const table = plainTable(["claim", "verdict", "what is claimed, and where", "what was measured"], rows);
  table.classList.add("claims");
  body.append(findingTotals(), table);
  return () => {};
}
