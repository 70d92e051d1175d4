#include "harness/io/cell_reader.h"

namespace nullmark {

std::string CellReader::one(const JsonNode& node) const {
  node.expect_keys({"cell"});
  return node["cell"].string();
}

std::vector<std::string> CellReader::all(const JsonNode& node) const {
  std::vector<std::string> names;
  for (const JsonNode& entry : node.elements_or_self()) names.push_back(one(entry));
  if (names.empty()) node.expected("at least one cell");
  return names;
}

std::vector<std::string> CellReader::counterparts(const JsonNode&, const JsonNode& node) const { return all(node); }

bool CellReader::is_judged(const std::string&) const { return true; }

}  // namespace nullmark
