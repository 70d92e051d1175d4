#pragma once

#include <cstddef>
#include <string>

namespace nullmark {

/// Part `index` of `count` of a configuration's work, index from 0.
struct Shard {
  std::size_t index = 0, count = 1;

  std::string text() const;  ///< "2/4" for index 1
};

/// What `--shard` asks for: "K/N"; "auto", from what a scheduler has put into the environment; or "auto/N", where it does not say
/// how many tasks there are.  Empty: all cells.  Throws InputError with the remedy.
///
///   Slurm           SLURM_ARRAY_TASK_ID, _MIN, _STEP and _COUNT
///   Grid Engine     SGE_TASK_ID, SGE_TASK_FIRST, SGE_TASK_LAST and SGE_TASK_STEPSIZE
///   AWS Batch       AWS_BATCH_JOB_ARRAY_INDEX and AWS_BATCH_JOB_ARRAY_SIZE
///   Kubernetes      JOB_COMPLETION_INDEX; no count
///   Open MPI        OMPI_COMM_WORLD_RANK and OMPI_COMM_WORLD_SIZE
///   MPICH, Intel    PMI_RANK and PMI_SIZE
///   GNU parallel    PARALLEL_SEQ; no count
Shard requested_shard(const std::string& text);

}  // namespace nullmark
