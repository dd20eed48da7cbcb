#include "tools/batch/slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/file_hash.hpp"
#include "tools/batch/step_work.hpp"

namespace selfcal::batch {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Part = std::vector<std::size_t>;

constexpr std::size_t parts_at_most = 1000;  // Slurm's MaxArraySize is 1001 unless it is configured
constexpr int idle_rounds_at_most = 3;
constexpr auto patience = std::chrono::minutes(2);
constexpr auto pause_between_looks = std::chrono::seconds(2);

std::string job_name(const BatchFolder& folder) {
  return "selfcal-" + sha256_of_text(folder.path().string()).substr(0, 12);
}

// As the shell takes it for one word.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return out + "'";
}

std::vector<Part> cut(const std::vector<std::size_t>& tasks, std::size_t tasks_a_job) {
  const std::size_t parts = std::min(parts_at_most, (tasks.size() + tasks_a_job - 1) / tasks_a_job);
  std::vector<Part> all(parts);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    all[i * parts / tasks.size()].push_back(tasks[i]);
  }
  return all;
}

class Cluster {
 public:
  Cluster(const BatchFolder& folder, const SlurmOptions& options, const Bounds& bounds)
      : folder_(folder), options_(options), bounds_(bounds), scratch_(folder.path() / "slurm") {}

  // Jobs of this batch that wait or run.
  Expected<std::size_t> jobs() const {
    return answer_of({"squeue", "--noheader", "--name", job_name(folder_), "--format", "%i"}, scratch_)
        .map([](const std::string& text) {
          return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
        });
  }

  // One array for each level that has open tasks, each after the one before it.
  Expected<void> submit(const std::vector<State>& states) {
    if (auto written = write_script(); !written) {
      return written;
    }
    std::string before;
    for (int level = 0; level < folder_.plan().levels(); ++level) {
      std::vector<std::size_t> tasks;
      for (std::size_t i = 0; i < states.size(); ++i) {
        if (states[i] == State::open && folder_.task(i).level == level) {
          tasks.push_back(i);
        }
      }
      if (tasks.empty()) {
        continue;
      }
      const auto job = submit_level(cut(tasks, options_.tasks_a_job), before);
      if (!job) {
        return tl::unexpected(job.error());
      }
      before = *job;
    }
    return {};
  }

 private:
  // A worker that was killed (by somebody, or for want of memory) is begun again in the same job: what a task may take with it is
  // counted by its tries, and what is killed before it takes one by the workers of the job.
  Expected<void> write_script() const {
    constexpr int most_workers = 20;  // one behind the other
    return write_file_atomically(
        scratch_ / "work.sh",
        fmt::format("#!/bin/sh\nstatus=137 left={}\nwhile [ $status -eq 137 ] && [ $left -gt 0 ]; do\n  {} batch work "
                    "{} --round \"$1\" "
                    "--tries {} --limit {}\n  status=$?\n  left=$((left - 1))\ndone\nexit $status\n",
                    most_workers, quoted((program_folder() / "selfcal").string()), quoted(folder_.path().string()),
                    bounds_.tries, bounds_.limit_s));
  }

  // Number of the array.
  Expected<std::string> submit_level(const std::vector<Part>& parts, const std::string& before) const {
    const std::string text = nlohmann::json(parts).dump();
    const std::string round = sha256_of_text(text);
    if (auto written = write_file_atomically(scratch_ / (round + ".json"), text); !written) {
      return tl::unexpected(written.error());
    }
    std::vector<std::string> words = {
        "sbatch",
        "--parsable",
        "--no-requeue",  // what a lost node leaves is submitted again at once; Slurm would wait two minutes
        "--open-mode=append",
        "--ntasks=1",
        "--cpus-per-task=1",
        "--job-name=" + job_name(folder_),
        "--chdir=" + folder_.path().string(),
        "--output=" + (scratch_ / "%A_%a.out").string(),
        fmt::format("--array=0-{}", parts.size() - 1)};
    if (!before.empty()) {
      words.push_back("--dependency=afterany:" + before);
    }
    words.insert(words.end(), options_.sbatch.begin(), options_.sbatch.end());
    words.push_back((scratch_ / "work.sh").string());
    words.push_back(round);
    return answer_of(words, scratch_).map([](const std::string& answer) {
      return answer.substr(0, answer.find_first_of(";\n"));
    });
  }

  const BatchFolder& folder_;
  const SlurmOptions& options_;
  const Bounds& bounds_;
  fs::path scratch_;
};

// Those that have ended since the last look, told once.
class Watch {
 public:
  Watch(const BatchFolder& folder, const OnEnded& on_ended) : folder_(folder), on_ended_(on_ended) {
    const auto states = folder.states();
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (states[i] == State::open || states[i] == State::blocked) {
        open_.push_back(i);
      }
    }
  }

  void look() {
    std::erase_if(open_, [&](std::size_t task) {
      const bool ended = folder_.has_result(task) || folder_.failure(task);
      if (ended) {
        on_ended_(task);
      }
      return ended;
    });
  }
  std::size_t open() const { return open_.size(); }

 private:
  const BatchFolder& folder_;
  const OnEnded& on_ended_;
  std::vector<std::size_t> open_;
};

}  // namespace

Expected<void> drive_slurm(BatchFolder& folder, const SlurmOptions& options, const Bounds& bounds,
                           const OnEnded& on_ended) {
  Cluster cluster(folder, options, bounds);
  Watch watch(folder, on_ended);
  auto answered = Clock::now();
  std::size_t open_before = watch.open() + 1;
  for (int idle = 0;;) {
    const auto jobs = cluster.jobs();
    watch.look();
    auto trouble = jobs ? Expected<void>{} : tl::unexpected(jobs.error());
    if (jobs && *jobs == 0) {
      const auto states = folder.states();
      if (count(states).open == 0 || folder.paused()) {
        return {};
      }
      idle = watch.open() < open_before ? 0 : idle + 1;
      open_before = watch.open();
      if (idle == idle_rounds_at_most) {
        return fail(ErrorKind::device, fmt::format("Slurm: {} submissions ended no task: see {}", idle,
                                                   (folder.path() / "slurm").string()));
      }
      trouble = cluster.submit(states);
    }
    answered = trouble ? Clock::now() : answered;
    if (!trouble && Clock::now() - answered > patience) {
      return fail(trouble.error().kind, trouble.error().message + "; its jobs go on, `selfcal batch resume` follows");
    }
    std::this_thread::sleep_for(pause_between_looks);
  }
}

Expected<void> work_part(BatchFolder& folder, const std::string& round, std::size_t part, const Bounds& bounds) {
  const fs::path file = folder.path() / "slurm" / (round + ".json");
  const auto text = read_text_file(file, 100'000'000);
  if (!text) {
    return tl::unexpected(text.error());
  }
  const auto parts = nlohmann::json::parse(*text, nullptr, false);
  if (!parts.is_array() || part >= parts.size()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: no part {}", file.string(), part));
  }
  const auto tasks = parts[part].get<std::vector<std::size_t>>();
  if (std::any_of(tasks.begin(), tasks.end(), [&](std::size_t task) { return task >= folder.plan().tasks.size(); })) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: part {}: a task that the plan does not have", file.string(), part));
  }
  return check_programs(folder.plan()).and_then([&]() -> Expected<void> {
    return work_off(folder, tasks, 1, bounds, [](std::size_t) {});
  });
}

}  // namespace selfcal::batch
