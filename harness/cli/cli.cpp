#include "harness/cli/cli.h"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <system_error>

#include "harness/cli/command_line.h"
#include "harness/cli/process.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/text.h"
#include "harness/model/program_name.h"
#include "harness/registry/estimator_entry.h"
#include "media/base/registry.h"
#include "media/majorants/register_majorant.h"

namespace nullmark {
namespace {

ExitCode report(ExitCode code, const std::string& message) {
  notice("nullmark: {}\n", one_line(message));
  return code;
}

/// Cells of two trackers of one name could not be told apart.
template <class Entry>
void refuse_shared_names(const char* what) {
  const std::string& name = Registry<Entry>::instance().taken_twice();
  if (!name.empty()) throw InputError(fmt::format("two {} are registered as \"{}\"; rename that of the plug-in", what, name));
}

ExitCode guarded(int argc, char** argv) {
  try {
    refuse_shared_names<EstimatorEntry>("estimators");
    refuse_shared_names<MediumEntry>("media");
    refuse_shared_names<MajorantEntry>("majorants");
    return execute_command_line(argc, argv);
  } catch (const InputError& error) {
    return report(ExitCode::input_error, error.what());
  } catch (const MissingData& error) {
    return report(ExitCode::input_error, error.what());
  } catch (const ParameterError& error) {
    return report(ExitCode::input_error, (error.parameter.empty() ? "" : error.parameter + ": ") + error.what());
  } catch (const std::bad_alloc&) {
    return report(ExitCode::input_error, "not enough memory; use fewer rays, cells or grid cells");
  } catch (const std::filesystem::filesystem_error& error) {
    // Of a path that users gave, such as a loop of links.
    return report(ExitCode::input_error,
                  fmt::format("{}: {}; give another path", error.path1().string(), error.code().message()));
  } catch (const std::system_error& error) {
    // Of fmt, where the terminal's or the pipe's end is a full disk.
    return report(ExitCode::internal_error, error.what());
  } catch (const std::exception& error) {
    return report(ExitCode::internal_error, fmt::format("internal error: {}", error.what()));
  }
}

}  // namespace

int nullmark_main(int argc, char** argv) {
  open_closed_descriptors();
  report_files_that_grow_too_large();
  return_freed_memory();
  tell_of_crashes();
  if (argc > 0) program_name() = std::filesystem::path(argv[0]).filename().string();
  ExitCode code = guarded(argc, argv);
  // A full disk or a closed pipe shows only here.
  if (std::fflush(stdout) != 0 && code == ExitCode::ok)
    code = report(ExitCode::internal_error, "standard output cannot be written");
  return static_cast<int>(code);
}

}  // namespace nullmark
