#pragma once

#include <string>

namespace nullmark {

/// Throws InputError where the figures' folder cannot be one or no Chromium is found, before anything is done.
void expect_figures_possible(const std::string& folder);

/// Has a headless Chromium draw the main plots of a report's page and writes each as NAME.svg and NAME.png into a folder, which
/// is made where it is missing; returns how many.  Throws InputError where no Chromium is found or it draws nothing.
std::size_t write_figures(const std::string& page_file, const std::string& folder);

}  // namespace nullmark
