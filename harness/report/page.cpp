#include "harness/report/page.h"

#include <map>
#include <string_view>

#include "harness/io/packing.h"

// The parts of the page, as they lie in the source and the build folder.
#define NULLMARK_ASSET(name, path)                              \
  asm(".pushsection .rodata\n"                                  \
      ".global nullmark_asset_" #name                           \
      "\n"                                                      \
      ".global nullmark_asset_" #name                           \
      "_end\n"                                                  \
      "nullmark_asset_" #name ":\n.incbin \"" path              \
      "\"\n"                                                    \
      "nullmark_asset_" #name "_end:\n.byte 0\n.popsection\n"); \
  extern "C" const char nullmark_asset_##name[], nullmark_asset_##name##_end[]

NULLMARK_ASSET(page, NULLMARK_REPORT_FOLDER "/page.html");
NULLMARK_ASSET(style, NULLMARK_REPORT_FOLDER "/page.css");
NULLMARK_ASSET(boot, NULLMARK_REPORT_FOLDER "/page_boot.js");
NULLMARK_ASSET(script, NULLMARK_PAGE_SCRIPT);
NULLMARK_ASSET(plotly, NULLMARK_PLOTLY);
NULLMARK_ASSET(plotly_licence, NULLMARK_PLOTLY_LICENCE);

namespace nullmark {
namespace {

#define NULLMARK_ASSET_TEXT(name) \
  std::string_view(nullmark_asset_##name, static_cast<std::size_t>(nullmark_asset_##name##_end - nullmark_asset_##name))

std::string html(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

}  // namespace

std::string page_beginning() {
  const std::string_view page = NULLMARK_ASSET_TEXT(page);
  return std::string(page.substr(0, page.find("{{")));
}

std::string report_page(const Json& data) {
  const std::map<std::string_view, std::string> parts = {
      {"title", html(data.value("title", "nullmark"))},
      {"css", std::string(NULLMARK_ASSET_TEXT(style))},
      {"plotly", std::string(NULLMARK_ASSET_TEXT(plotly))},
      {"plotly_licence", html(NULLMARK_ASSET_TEXT(plotly_licence))},
      {"boot", std::string(NULLMARK_ASSET_TEXT(boot))},
      {"script", std::string(NULLMARK_ASSET_TEXT(script))},
      {"data", packed(data.dump(-1, ' ', false, Json::error_handler_t::replace))}};
  const std::string_view page = NULLMARK_ASSET_TEXT(page);
  std::string result;
  std::size_t at = 0;
  while (at < page.size()) {
    const std::size_t open = page.find("{{", at), close = page.find("}}", open);
    if (open == std::string_view::npos || close == std::string_view::npos) break;
    result += page.substr(at, open - at);
    result += parts.at(page.substr(open + 2, close - open - 2));
    at = close + 2;
  }
  result += page.substr(at);
  return result;
}

}  // namespace nullmark
