// Runs tasks as children of this process, a few at a time, and writes into the batch's folder what came of each.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "tools/batch/batch_folder.hpp"
#include "tools/batch/child.hpp"

namespace selfcal::batch {

struct Bounds {
  int tries = 3;            // of a task whose program fails; what it refuses as bad input is not tried again
  unsigned limit_s = 3600;  // of one try
};

class Executor {
 public:
  Executor(BatchFolder& folder, Bounds bounds) : folder_(folder), bounds_(bounds) {}

  // Begins the task: a child runs, or what needs none is done at once. An error: of this machine or its disk, not the
  // task's.
  Expected<void> start(std::size_t task);
  std::size_t running() const { return running_.size(); }
  // Waits for the next child to end and writes what came of it. The task; its state is in the folder: open again where it
  // may be tried again.
  Expected<std::size_t> wait();

 private:
  struct Running {
    std::size_t task;
    std::filesystem::path scratch;
    std::chrono::steady_clock::time_point begun;
  };

  Expected<void> conclude(const Running& running, const ChildEnd& end);
  Expected<void> failed_try(std::size_t task, const std::string& line, bool final);

  BatchFolder& folder_;
  Bounds bounds_;
  std::map<pid_t, Running> running_;
};

// Which task is next: those that are open and whose needs are done, in the plan's order.
class Agenda {
 public:
  // Of these. What another one has to do first is not waited for.
  Agenda(const BatchFolder& folder, const std::vector<std::size_t>& tasks);

  std::optional<std::size_t> next();  // takes it off
  void put_back(std::size_t task);    // to be tried again
  void done(std::size_t task);        // what only waited for it is next

 private:
  std::vector<std::size_t> ready_;  // the last is next
  std::map<std::size_t, std::size_t> unmet_;
  std::map<std::size_t, std::vector<std::size_t>> waiting_for_;
};

using OnEnded = std::function<void(std::size_t task)>;  // done, or failed for good

// Runs these tasks, `jobs` at a time, until none is left that can be run, or the batch is paused: then those that run are
// waited for. An error: of this machine or its disk; what was done stays.
Expected<void> work_off(BatchFolder& folder, const std::vector<std::size_t>& tasks, std::size_t jobs,
                        const Bounds& bounds, const OnEnded& on_ended);

}  // namespace selfcal::batch
