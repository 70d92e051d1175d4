// What a room may include is the table in CONTRIBUTING.md: every #include of the product is held against it.  Tests, benchmarks,
// planted trackers and examples may include anything.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace nullmark {
namespace {

namespace fs = std::filesystem;
const fs::path kTree = NULLMARK_SOURCE_DIR;

/// Rows "| `room/` | what lives there | `may/` `use/` |" of the page's table, by room.
std::map<std::string, std::set<std::string>> rooms() {
  std::map<std::string, std::set<std::string>> may;
  std::ifstream page(kTree / "CONTRIBUTING.md");
  const std::regex row("^\\| `([a-z_/]+)/` \\|[^|]*\\|(.*)\\|$"), room("`([a-z_/]+)/`");
  for (std::string line; std::getline(page, line);) {
    std::smatch match;
    if (!std::regex_match(line, match, row)) continue;
    const std::string uses = match[2];
    std::set<std::string>& allowed = may[match[1]];
    for (std::sregex_iterator at(uses.begin(), uses.end(), room), end; at != end; ++at) allowed.insert((*at)[1]);
  }
  return may;
}

/// The most deeply nested room that holds a path; empty where none does.
std::string room_of(const std::string& path, const std::map<std::string, std::set<std::string>>& may) {
  std::string folder = fs::path(path).parent_path().generic_string();
  while (!folder.empty() && !may.contains(folder)) folder = fs::path(folder).parent_path().generic_string();
  return folder;
}

bool is_product(const std::string& path) {
  static const std::regex kOthers("_(test|bench)\\.(h|cpp)$|/(testing|planted|plugin_example)/|^harness/main\\.cpp$");
  return std::regex_search(path, std::regex("\\.(h|cpp)$")) && !std::regex_search(path, kOthers);
}

TEST(Rooms, IncludesFollowTheTableOfContributing) {
  const auto may = rooms();
  ASSERT_GT(may.size(), 15u);
  const std::regex include("^#include \"((media|estimators|harness)/[^\"]+)\"");
  std::size_t arrows = 0;
  for (const char* top : {"media", "estimators", "harness"})
    for (const auto& entry : fs::recursive_directory_iterator(kTree / top)) {
      const std::string path = fs::relative(entry.path(), kTree).generic_string();
      if (!entry.is_regular_file() || !is_product(path)) continue;
      const std::string room = room_of(path, may);
      EXPECT_NE(room, "") << path << " is in no room";
      std::ifstream source(entry.path());
      for (std::string line; std::getline(source, line);) {
        std::smatch match;
        if (!std::regex_search(line, match, include)) continue;
        const std::string used = room_of(match[1], may);
        ++arrows;
        EXPECT_TRUE(used == room || may.at(room).contains(used)) << path << " may not include " << match[1];
      }
    }
  EXPECT_GT(arrows, 300u);
}

/// Rooms that may use each other, over any others, are one room.
TEST(Rooms, TheTableHasNoCircle) {
  auto may = rooms();
  while (!may.empty()) {
    const auto free = std::find_if(may.begin(), may.end(), [&](const auto& room) {
      return std::none_of(room.second.begin(), room.second.end(), [&](const std::string& used) { return may.contains(used); });
    });
    ASSERT_NE(free, may.end()) << may.begin()->first << " is in a circle";
    may.erase(free);
  }
}

TEST(Rooms, HarnessItselfHoldsTheProgramAlone) {
  for (const auto& entry : fs::directory_iterator(kTree / "harness"))
    if (entry.path().extension() == ".cpp" || entry.path().extension() == ".h") {
      EXPECT_EQ(entry.path().filename(), "main.cpp");
    }
}

}  // namespace
}  // namespace nullmark
