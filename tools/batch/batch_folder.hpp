// The folder of a batch, on a disk that its machines share: plan, results by key, tries, failures. All that a batch knows
// stands there, each piece complete or not at all, so that whoever dies is taken up again by reading it.
//
//   plan.json   results/ab/KEY.json   tries/KEY   failed/KEY   work/ (of tasks that run)   recordings/ab/SHA256
//   inputs/ (files that options name)   log/ (processor time)   slurm/ (job script, rounds, output)   paused
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tools/batch/task.hpp"

namespace selfcal::batch {

inline constexpr int lost_at_most = 10;  // times that a task takes its worker with it before it counts as failed

// What a task has come to. The order is that of the counts in `status`.
enum class State { done, failed, blocked, open };  // blocked: a task that it needs has failed

struct Tries {
  int begun = 0, failed = 0;
  int lost() const { return begun - failed; }  // of a task that is not done: its worker died
  std::string line;                            // of the last failure
};

struct Counts {
  std::size_t done = 0, failed = 0, blocked = 0, open = 0;
  std::size_t all() const { return done + failed + blocked + open; }
};

class BatchFolder {
 public:
  // Makes the folder with this plan, or opens it where its plan is the same. An error (usage) where it holds another one.
  static Expected<BatchFolder> create(const std::filesystem::path& folder, const Plan& plan);
  static Expected<BatchFolder> open(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return path_; }
  const Plan& plan() const { return plan_; }
  const Task& task(std::size_t index) const { return plan_.tasks[index]; }

  std::filesystem::path result_path(std::size_t index) const;
  bool has_result(std::size_t index) const;
  Expected<nlohmann::ordered_json> result(std::size_t index) const;
  // As it stands on disk. A result that is there already must be the same to the byte: an error (internal) where not.
  Expected<void> keep_result(std::size_t index, const std::string& text);

  Tries tries(std::size_t index) const;
  Expected<void> note_begun(std::size_t index);
  Expected<void> note_failed_try(std::size_t index, const std::string& line);
  // Ends the task: it is not tried again.
  Expected<void> note_failed(std::size_t index, const std::string& line);
  std::optional<std::string> failure(std::size_t index) const;
  // Failed tasks are open again.
  Expected<void> forget_failures();

  // Of every task, by what is on disk now.
  std::vector<State> states() const;

  bool paused() const;
  Expected<void> pause(bool on);

  // One driver at a time: held until the returned object goes. An error (usage) where another one holds it.
  Expected<std::shared_ptr<void>> lock() const;

  void log_cost(std::size_t index, double processor_s, double wall_s);
  double processor_s() const;  // of all tries that were waited for

 private:
  BatchFolder(std::filesystem::path path, Plan plan) : path_(std::move(path)), plan_(std::move(plan)) {}

  std::filesystem::path path_;
  Plan plan_;
};

Counts count(const std::vector<State>& states);

}  // namespace selfcal::batch
