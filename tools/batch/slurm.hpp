// A batch on a Slurm cluster whose machines share the batch's folder: an array of jobs for each level of tasks, each array
// after the one that it needs. A job runs its tasks one after the other. What a killed job or node left is submitted again.
#pragma once

#include <string>
#include <vector>

#include "tools/batch/executor.hpp"

namespace selfcal::batch {

struct SlurmOptions {
  std::size_t tasks_a_job = 8;
  std::vector<std::string> sbatch;  // further options of sbatch: --partition=..., --mem=...
};

// Submits what is open and follows it until nothing is left that can be run, or the batch is paused and its jobs have
// ended. Jobs of the batch that are in the queue already are followed first. An error (device) where Slurm does not answer
// for two minutes, or three submissions in a row brought nothing; jobs go on then.
Expected<void> drive_slurm(BatchFolder& folder, const SlurmOptions& options, const Bounds& bounds,
                           const OnEnded& on_ended);

// What a job does: the tasks of its part of a round.
Expected<void> work_part(BatchFolder& folder, const std::string& round, std::size_t part, const Bounds& bounds);

}  // namespace selfcal::batch
