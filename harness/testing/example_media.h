#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "harness/registry/components.h"
#include "media/volumes/vdb_writer.h"

namespace nullmark {

/// The procedural volume, 128 voxels across, as a file that lives as long as the process.
inline const std::string& example_volume_file() {
  static const struct File {
    File() { write_procedural_vdb(path); }
    ~File() {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
    }
    const std::string path =
        (std::filesystem::temp_directory_path() / ("nullmark_example_" + std::to_string(::getpid()) + ".vdb")).string();
  } file;
  return file.path;
}

/// A registered medium at its defaults; one that is read from a file reads the procedural volume.
inline Component example_medium(const std::string& type) {
  Component medium{type, {}, type, {}};
  for (const ParameterInfo& parameter : parameters_of(ComponentKind::medium, type))
    if (parameter.name == "file") medium.values["file"] = example_volume_file();
  return medium;
}

}  // namespace nullmark
