#pragma once

#include <memory>
#include <string>

#include "harness/foreign/foreign_tracker.h"

namespace nullmark {

/// A tracker of a shared library, in this process.  `path` is a path, never searched for; `name` chooses among the library's
/// trackers, empty: the only one.  Throws ParameterError if the file cannot be loaded, has no nullmark_get_tracker or another
/// version of the interface, or if the tracker refuses its parameters.
std::shared_ptr<const ForeignTracker> open_library(const std::string& path, const std::string& name,
                                                   const std::string& parameters);

/// Whether open_library has loaded any code into this process.  May be called in a handler of signals.
bool library_is_loaded() noexcept;

}  // namespace nullmark
