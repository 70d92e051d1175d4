#pragma once

#include <string>

#include "media/base/registry.h"

namespace nullmark {

/// What a plug-in says of itself: see NULLMARK_PLUGIN.
struct PluginEntry {
  std::string name, version;
};

}  // namespace nullmark

/// States name and version of a plug-in, once in it, for the provenance of its results.
#define NULLMARK_PLUGIN(name, version)                                                     \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_plugin_, __COUNTER__) = \
      ::nullmark::Registry<::nullmark::PluginEntry>::instance().add(::nullmark::PluginEntry{name, version})
