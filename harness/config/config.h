#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// A configuration's text and the name that errors call it.
struct ConfigSource {
  std::string text, file;
};

/// Expands a configuration (format: config.md) into a plan.  `seed` takes the place of the file's own; experiments that sweep the
/// seed keep theirs.  Throws InputError, one line that names the file and the place in it.
Plan read_config(const std::string& text, const std::string& file, std::optional<std::uint64_t> seed = {});

/// Joins several configurations into one plan.  Experiments of the same name are told apart by the names of their
/// configurations; the `timing` of all must agree.
Plan read_configs(const std::vector<ConfigSource>& sources, std::optional<std::uint64_t> seed = {});

/// Reads files, and the *.json of directories in the order of their names; "-" is standard input.  Throws InputError.
std::vector<ConfigSource> load_configs(const std::vector<std::string>& paths);

}  // namespace nullmark
