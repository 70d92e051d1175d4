#include "harness/io/claims_json.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "harness/io/text.h"
#include "harness/model/metrics.h"

namespace nullmark {
namespace {

const std::vector<std::string> kRelations = {"near", "at_most", "at_least", "unbiased"};

Json names_json(const std::vector<std::string>& names) {
  Json list = Json::array();
  for (const std::string& name : names) list.push_back({{"cell", name}});
  return list;
}

Json compared_with(const ClaimPart& part) {
  if (part.relation == Relation::unbiased) return true;
  if (part.theory) return "theory";
  return part.others.empty() ? Json(part.numbers) : names_json(part.others);
}

void read_compared_with(const JsonNode& part, const JsonNode& node, const CellReader& finder, ClaimPart& out) {
  if (node.json() == "theory" && out.slope_against.empty()) {
    out.theory = true;
    return;
  }
  const bool number = node.json().is_number() || (node.json().is_array() && !node.json().empty() && node[0].json().is_number());
  if (!number && !out.slope_against.empty()) node.expected("a number, which the slope is compared with");
  if (node.json().is_string())
    node.fail(
        fmt::format("found {}; expected a number, one for each cell, \"theory\" or a pattern of cells", node.json().dump()));
  if (number)
    for (const JsonNode& value : node.elements_or_self()) out.numbers.push_back(value.number());
  else
    out.others = finder.counterparts(part["cells"], node);
  const std::size_t count = std::max(out.numbers.size(), out.others.size());
  const std::size_t wanted = out.slope_against.empty() ? out.cells.size() : 1;
  if (count != wanted && !(number && count == 1))
    node.fail(fmt::format("found {} to compare with; expected {}, one for each of \"cells\"", count, wanted));
  for (std::size_t i = 0; i < out.others.size(); ++i)
    if (out.others[i] == out.cells[i])
      node.fail(fmt::format("\"{}\" would be compared with itself; expected another cell", out.cells[i]));
}

ClaimPart read_part(const JsonNode& node, const CellReader& finder) {
  std::vector<std::string> keys = {"says", "metric", "cells", "factor", "tolerance", "slope_against"};
  keys.insert(keys.end(), kRelations.begin(), kRelations.end());
  node.expect_keys(keys);
  ClaimPart part;
  if (node.has("says")) part.says = node["says"].string();
  part.cells = finder.all(node["cells"]);
  if (node.has("slope_against")) {
    part.slope_against = node["slope_against"].one_of(metric_names(), "metric");
    if (part.cells.size() < 3)
      node["cells"].fail(
          fmt::format("matches {} cells; expected three or more, through which a slope has an error", part.cells.size()));
  }
  if (node.has("factor")) part.factor = node["factor"].number();
  if (node.has("tolerance")) part.tolerance = node["tolerance"].positive();

  const auto given = [&](const std::string& relation) { return node.has(relation.c_str()); };
  if (std::count_if(kRelations.begin(), kRelations.end(), given) != 1)
    node.fail("expected exactly one of \"near\", \"at_most\", \"at_least\" and \"unbiased\"");
  const auto relation = std::find_if(kRelations.begin(), kRelations.end(), given);
  part.relation = static_cast<Relation>(relation - kRelations.begin());
  if (part.relation == Relation::unbiased) {
    if (!node["unbiased"].boolean()) node["unbiased"].expected("true");
    for (const char* other : {"metric", "factor", "tolerance", "slope_against"})
      if (node.has(other)) node[other].fail("does not apply to \"unbiased\"");
    for (const std::string& cell : part.cells)
      if (!finder.is_judged(cell))
        node["cells"].fail(fmt::format("\"{}\" gets no verdict; expected its \"verdict\" to be enabled", cell));
    return part;
  }
  part.metric = node["metric"].one_of(metric_names(), "metric");
  const std::vector<std::string>& claimable = claimable_metric_names();
  if (std::find(claimable.begin(), claimable.end(), part.metric) == claimable.end())
    node["metric"].fail(fmt::format("\"{}\" has no standard error, so no claim can test it; expected one of {}", part.metric,
                                    fmt::join(claimable, ", ")));
  if (node.has("tolerance") != (part.relation == Relation::near))
    node.fail("expected \"tolerance\" beside \"near\", and only there");
  read_compared_with(node, node[*relation], finder, part);
  return part;
}

}  // namespace

Json claims_json(const std::vector<PublishedClaim>& claims) {
  Json list = Json::array();
  for (const PublishedClaim& claim : claims) {
    Json parts = Json::array();
    for (const ClaimPart& part : claim.parts) {
      Json entry = Json::object();
      if (!part.says.empty()) entry["says"] = part.says;
      if (!part.metric.empty()) entry["metric"] = part.metric;
      entry["cells"] = names_json(part.cells);
      entry[kRelations[static_cast<std::size_t>(part.relation)]] = compared_with(part);
      if (part.factor != 1) entry["factor"] = part.factor;
      if (part.tolerance > 0) entry["tolerance"] = part.tolerance;
      if (!part.slope_against.empty()) entry["slope_against"] = part.slope_against;
      parts.push_back(std::move(entry));
    }
    Json entry = {{"id", claim.id}, {"source", claim.source}, {"claim", claim.claim}};
    if (!claim.note.empty()) entry["note"] = claim.note;
    if (claim.required) entry["required"] = true;
    entry["parts"] = std::move(parts);
    list.push_back(std::move(entry));
  }
  return list;
}

void read_claims(const JsonNode& node, const CellReader& finder, std::vector<PublishedClaim>& claims) {
  std::set<std::string> ids;
  for (const PublishedClaim& earlier : claims) ids.insert(earlier.id);
  for (const JsonNode& entry : node.elements()) {
    entry.expect_keys({"id", "source", "claim", "note", "required", "parts"});
    PublishedClaim claim{
        printable(entry["id"].string()), printable(entry["source"].string()), printable(entry["claim"].string()), "", {}};
    if (entry.has("note")) claim.note = entry["note"].string();
    if (entry.has("required")) claim.required = entry["required"].boolean();
    if (!ids.insert(claim.id).second)
      entry["id"].fail(fmt::format("\"{}\" is the id of an earlier claim; expected another", claim.id));
    for (const JsonNode& part : entry["parts"].elements()) claim.parts.push_back(read_part(part, finder));
    if (claim.parts.empty()) entry["parts"].expected("at least one comparison");
    claims.push_back(std::move(claim));
  }
}

}  // namespace nullmark
