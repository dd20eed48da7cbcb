// What each step does: the command that it runs, and its result from what that printed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tools/batch/batch_folder.hpp"

namespace selfcal::batch {

// The folder that this program and those of the other steps stand in.
std::filesystem::path program_folder();

// Whether the programs of `plan` are here, and the builds that it was planned with; else an error (bad_input).
Expected<void> check_programs(const Plan& plan);

// Words of the command; empty: none, finish() does the work. `scratch` is the task's own empty folder.
Expected<std::vector<std::string>> command_of(const BatchFolder& folder, std::size_t task,
                                              const std::filesystem::path& scratch);

// The task's result as it is kept: one JSON document in which nothing depends on when, where or how fast it was made.
// `output` is what the command printed.
Expected<std::string> finish(const BatchFolder& folder, std::size_t task, const std::filesystem::path& scratch,
                             int exit_status, const std::string& output);

}  // namespace selfcal::batch
