#pragma once

#include <string>

namespace nullmark {

/// Has a headless Chromium draw the main plots of a report's page and writes each as NAME.svg and NAME.png into a folder, which
/// is made where it is missing; returns how many.  Throws InputError where no Chromium is found or it draws nothing.
std::size_t write_figures(const std::string& page_file, const std::string& folder);

}  // namespace nullmark
