#include "harness/cli/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "harness/io/json_input.h"
#include "harness/io/text.h"

namespace nullmark {
namespace {

/// A whole number of the environment; none where it is unset or no number, such as Grid Engine's "undefined".
std::optional<std::size_t> environment(const char* name) {
  const char* value = name ? std::getenv(name) : nullptr;
  return value ? whole_number(value) : std::nullopt;
}

/// Where a scheduler tells the number of a task, and of how many.
struct Scheduler {
  const char *task, *first, *step, *count, *last;  ///< null: from `from`, 1, not told
  std::size_t from = 0;                            ///< the first task's number where `first` is null
};

constexpr Scheduler kSchedulers[] = {
    {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_STEP", "SLURM_ARRAY_TASK_COUNT", nullptr},
    {"SGE_TASK_ID", "SGE_TASK_FIRST", "SGE_TASK_STEPSIZE", nullptr, "SGE_TASK_LAST"},
    {"AWS_BATCH_JOB_ARRAY_INDEX", nullptr, nullptr, "AWS_BATCH_JOB_ARRAY_SIZE", nullptr},
    {"JOB_COMPLETION_INDEX", nullptr, nullptr, nullptr, nullptr},
    {"OMPI_COMM_WORLD_RANK", nullptr, nullptr, "OMPI_COMM_WORLD_SIZE", nullptr},
    {"PMI_RANK", nullptr, nullptr, "PMI_SIZE", nullptr},
    {"PARALLEL_SEQ", nullptr, nullptr, nullptr, nullptr, 1}};

/// `given` is the number of tasks that the user says.
Shard of_scheduler(std::optional<std::size_t> given) {
  for (const Scheduler& one : kSchedulers) {
    const auto task = environment(one.task);
    if (!task) continue;
    const std::size_t first = environment(one.first).value_or(one.from);
    const std::size_t step = std::max<std::size_t>(1, environment(one.step).value_or(1));
    std::optional<std::size_t> count = given ? given : environment(one.count);
    if (const auto last = environment(one.last); !count && last && *last >= first) count = (*last - first) / step + 1;
    if (!count)
      throw InputError(fmt::format("--shard: {} does not say of how many tasks; expected auto/N, as in auto/16", one.task));
    const std::size_t index = *task < first ? *count : (*task - first) / step;
    if (index >= *count)
      throw InputError(fmt::format("--shard: found the task {}={} of {} tasks, the first {}; expected one of them", one.task,
                                   *task, *count, first));
    return {index, *count};
  }
  throw InputError(
      "--shard: found no task of Slurm, Grid Engine, AWS Batch, Kubernetes, MPI or GNU parallel in the environment; expected "
      "K/N, "
      "as in 2/4");
}

}  // namespace

std::string Shard::text() const { return fmt::format("{}/{}", index + 1, count); }

Shard requested_shard(const std::string& text) {
  if (text.empty()) return {};
  const std::size_t slash = text.find('/');
  const std::string first = text.substr(0, slash);
  const auto count = slash == std::string::npos ? std::nullopt : whole_number(std::string_view(text).substr(slash + 1));
  const bool told = slash != std::string::npos;
  if (first == "auto" && (!told || (count && *count > 0))) return of_scheduler(count);
  const auto index = whole_number(first);
  if (index && count && *index >= 1 && *index <= *count) return {*index - 1, *count};
  throw InputError(
      fmt::format("--shard: found \"{}\"; expected K/N with 1 <= K <= N, as in 2/4, or auto for a scheduler's task", text));
}

}  // namespace nullmark
