#include "harness/report/figures.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/packing.h"
#include "harness/io/text.h"

namespace nullmark {
namespace {

std::string find_browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
    if (std::system(fmt::format("command -v {} >/dev/null 2>&1", name).c_str()) == 0) return name;
  throw InputError("--figures: needs Chromium, which is not installed; apt install chromium");
}

/// Words that open a page of a file without a window.
std::string browser_command(const std::string& options, const std::string& file, const std::string& query = "") {
  // Chromium's sandbox refuses to start as root, as in containers; the page is ours and loads nothing.
  return fmt::format("{} --headless=new {} --disable-gpu {} {} 2>/dev/null", find_browser(),
                     ::geteuid() == 0 ? "--no-sandbox" : "", options,
                     shell_quoted("file://" + std::filesystem::absolute(file).string() + query));
}

/// A figure as a page of its own size.
void print_pdf(const Json& figure, const std::string& path) {
  const std::string page = path + ".html";
  write_atomically(page,
                   fmt::format("<!DOCTYPE html><style>@page {{ size: {}px {}px; margin: 0 }} body {{ margin: 0 }}</style>{}",
                               figure.at("width").dump(), figure.at("height").dump(), figure.at("svg").get<std::string>()));
  const std::string options =
      "--no-pdf-header-footer --print-to-pdf=" + shell_quoted(std::filesystem::absolute(path + ".pdf").string());
  const int code = std::system((browser_command(options, page) + " >/dev/null").c_str());
  std::filesystem::remove(page);
  if (code != 0) throw InputError(fmt::format("--figures: Chromium printed no {}.pdf", path));
}

/// The page after its scripts have run.
std::string drawn_page(const std::string& page_file) {
  const std::string command =
      browser_command("--hide-scrollbars --virtual-time-budget=120000 --dump-dom", page_file, "?figures=1");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), &::pclose);
  if (!pipe) throw std::runtime_error("Chromium cannot be started");
  std::string text;
  std::array<char, 65536> buffer;
  while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) text.append(buffer.data(), got);
  return text;
}

}  // namespace

void expect_figures_possible(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path there = fs::absolute(folder, error);
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, error))
    throw InputError(
        fmt::format("--figures: {}: {} is not a folder; give a path where one can be created", folder, there.string()));
  find_browser();
}

std::size_t write_figures(const std::string& page_file, const std::string& folder) {
  const std::string page = drawn_page(page_file);
  const std::string_view open = "<script type=\"application/json\" id=\"figures\">", close = "</script>";
  const std::size_t begin = page.find(open), end = page.find(close, begin);
  if (begin == std::string::npos || end == std::string::npos)
    throw InputError(fmt::format("--figures: Chromium drew no figures from {}; open it in a browser to see why", page_file));
  const Json figures = parse_json(page.substr(begin + open.size(), end - begin - open.size()), page_file);
  std::filesystem::create_directories(folder);
  std::string index = "% figures of nullmark report, for \\usepackage{graphicx}\n";
  for (const Json& figure : figures) {
    const std::string path = (std::filesystem::path(folder) / figure.at("name").get<std::string>()).string();
    write_atomically(path + ".svg", figure.at("svg").get<std::string>());
    write_atomically(path + ".png", from_base64(figure.at("png").get<std::string>()));
    print_pdf(figure, path);
    index += fmt::format(
        "\\begin{{figure}}\n\\centering\n\\includegraphics[width=\\linewidth]{{{}.pdf}}\n\\caption{{{}}}\n\\end{{figure}}\n",
        figure.at("name").get<std::string>(), latex(figure.at("caption").get<std::string>()));
  }
  write_atomically((std::filesystem::path(folder) / "figures.tex").string(), index);
  return figures.size();
}

}  // namespace nullmark
