#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// The text of a configuration, and its name in error messages.
struct ConfigSource {
  std::string text, file;
};

/// Expands a configuration (format: config.md) into a plan.  `seed` replaces the seed of the file; experiments that sweep the
/// seed keep theirs.  Throws InputError with one line that names the file and the place in it.
Plan read_config(const std::string& text, const std::string& file, std::optional<std::uint64_t> seed = {});

/// Joins several configurations into one plan.  Experiments of the same name get the name of their configuration in front; the
/// `timing` and `error_rates` of all must agree.
Plan read_configs(const std::vector<ConfigSource>& sources, std::optional<std::uint64_t> seed = {});

/// Reads files, and the *.json files of folders in the order of their names; "-" is standard input.  Throws InputError.
std::vector<ConfigSource> load_configs(const std::vector<std::string>& paths);

}  // namespace nullmark
