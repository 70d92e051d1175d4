#include "harness/io/tables_json.h"

#include "harness/io/text.h"
#include "harness/model/metrics.h"

namespace nullmark {

Json tables_json(const std::vector<Table>& tables) {
  Json list = Json::array();
  for (const Table& table : tables) {
    Json rows = Json::array();
    for (const TableRow& row : table.rows) {
      Json entry = {{"label", row.label}, {"given", Json::object()}, {"cells", Json::object()}};
      for (const auto& [heading, number] : row.given) entry["given"][heading] = number;
      for (const auto& [heading, cell] : row.cells) entry["cells"][heading] = {{"cell", cell}};
      if (row.theory_of) entry["theory"] = {{"cell", *row.theory_of}};
      if (row.relative_to) entry["relative_to"] = {{"cell", *row.relative_to}};
      if (!row.note.empty()) entry["note"] = row.note;
      rows.push_back(std::move(entry));
    }
    list.push_back({{"title", table.title}, {"metric", table.metric}, {"rows", std::move(rows)}});
  }
  return list;
}

namespace {

TableRow read_row(const JsonNode& node, const CellReader& finder) {
  if (node.has("tolerance"))
    node["tolerance"].fail("is not tested in a table; use a claim with \"required\": true, \"near\" and \"tolerance\"");
  node.expect_keys({"label", "given", "cells", "theory", "note", "relative_to"});
  TableRow row;
  row.label = printable(node["label"].string());
  if (node.has("note")) row.note = node["note"].string();
  if (node.has("given")) {
    node["given"].expect_object();
    for (const auto& [heading, json] : node["given"].json().items())
      row.given.emplace_back(heading, node["given"][heading].number());
  }
  if (node.has("cells")) {
    node["cells"].expect_object();
    for (const auto& [heading, json] : node["cells"].json().items())
      row.cells.emplace_back(heading, finder.one(node["cells"][heading]));
  }
  if (node.has("theory")) row.theory_of = finder.one(node["theory"]);
  if (node.has("relative_to")) row.relative_to = finder.one(node["relative_to"]);
  return row;
}

}  // namespace

std::vector<Table> read_tables(const JsonNode& node, const CellReader& finder) {
  std::vector<Table> tables;
  for (const JsonNode& entry : node.elements()) {
    entry.expect_keys({"title", "metric", "rows"});
    Table table;
    table.title = printable(entry["title"].string());
    if (entry.has("metric")) table.metric = entry["metric"].one_of(metric_names(), "metric");
    for (const JsonNode& row : entry["rows"].elements()) table.rows.push_back(read_row(row, finder));
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace nullmark
