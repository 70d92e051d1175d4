#pragma once

#include <string>

namespace nullmark {

/// Throws InputError if the folder of the figures cannot be created or Chromium is missing.  Call it before any work.
void expect_figures_possible(const std::string& folder);

/// Draws the main plots of a report's page in a headless Chromium and writes each as NAME.svg, NAME.png and NAME.pdf into a
/// folder, which it creates if needed, with figures.tex, which includes them with captions.  Returns the number of plots.  Throws
/// InputError if Chromium is missing or draws nothing.
std::size_t write_figures(const std::string& page_file, const std::string& folder);

}  // namespace nullmark
