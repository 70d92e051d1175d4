#pragma once

#include <memory>
#include <string>

#include "harness/foreign/child.h"
#include "harness/foreign/foreign_tracker.h"

namespace nullmark {

/// A tracker in a process of its own: `command` speaks the protocol of frames.h.  `parameters` is a JSON object.  One process is
/// started for each thread, and kept for the cells that follow; one that fails is ended, and the next cell gets a new one. Throws
/// ParameterError if the command cannot be started or does not greet.
std::shared_ptr<const ForeignTracker> open_process(const ChildSpec& spec, const std::string& parameters);

/// A library's tracker in a process of its own, which a crash or an endless loop of the library ends in place of this one.
std::shared_ptr<const ForeignTracker> open_isolated_library(const std::string& path, const std::string& name,
                                                            const std::string& parameters, double seconds);

}  // namespace nullmark
