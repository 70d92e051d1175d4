#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <new>
#include <string>

#include "harness/kernel/tracker_failure.h"
#include "media/base/parameters.h"
#include "media/base/registry.h"

namespace nullmark {

/// What `f` threw, as one line; empty if nothing.  Exceptions that are `Passed` are thrown on: they are of the harness.
template <class... Passed, class F>
std::string failure_of(F&& f) {
  std::string failure;
  try {
    f();
  } catch (const std::exception& error) {
    if ((dynamic_cast<const Passed*>(&error) || ...)) throw;
    const bool told = dynamic_cast<const TrackerFailure*>(&error);
    failure = told ? error.what() : fmt::format("the tracker threw: {}", error.what());
  } catch (...) {
    failure = "the tracker threw what is no std::exception";
  }
  std::replace(failure.begin(), failure.end(), '\n', ' ');
  return failure;
}

/// What a tracker throws is its cell's failure; a mistake in the configuration and a lack of memory are not.
template <class F>
std::string tracker_failure(F&& f) {
  return failure_of<ParameterError, MissingData, std::bad_alloc>(f);
}

}  // namespace nullmark
