#include "tools/batch/executor.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "protocol/recording/atomic_file.hpp"
#include "tools/batch/step_work.hpp"

namespace selfcal::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_output = 500'000'000;

// Status 1 is an answer of these: done, but the answer is no.
bool is_answer(Step step, int exit_status) {
  return exit_status == 0 || (exit_status == 1 && (step == Step::estimate || step == Step::diagnose ||
                                                   step == Step::answer || step == Step::score));
}

// Of another machine with the same process number too.
std::string scratch_name(const Task& task) {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  return fmt::format("{}.{}.{}", task.key, host, ::getpid());
}

std::string how_it_ended(const ChildEnd& end, const fs::path& scratch, unsigned limit_s) {
  if (end.signal == SIGALRM) {
    return fmt::format("not done within {} s", limit_s);
  }
  if (end.signal != 0) {
    return fmt::format("ended by {}", ::strsignal(end.signal));
  }
  const std::string line = first_line(scratch / "errors");
  return line.empty() ? fmt::format("status {} without a word", end.exit_status) : line;
}

}  // namespace

Expected<void> Executor::start(std::size_t task) {
  const int lost = folder_.tries(task).lost();
  if (lost >= lost_at_most) {
    return folder_.note_failed(task, fmt::format("its worker was lost {} times", lost));
  }
  if (auto noted = folder_.note_begun(task); !noted) {
    return noted;
  }
  Running running{task, folder_.path() / "work" / scratch_name(folder_.task(task)), std::chrono::steady_clock::now()};
  std::error_code error;
  fs::create_directories(running.scratch, error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", running.scratch.string(), error.message()));
  }
  const auto words = command_of(folder_, task, running.scratch);
  if (!words) {
    fs::remove_all(running.scratch, error);
    return failed_try(task, words.error().message, false);
  }
  if (words->empty()) {
    return conclude(running, {});
  }
  const auto child =
      start_child({*words, folder_.path(), running.scratch / "output", running.scratch / "errors", bounds_.limit_s});
  if (!child) {
    return tl::unexpected(child.error());
  }
  running_.emplace(*child, std::move(running));
  return {};
}

Expected<std::size_t> Executor::wait() {
  while (true) {
    const auto end = ended_child();
    if (!end) {
      return tl::unexpected(end.error());
    }
    const auto found = running_.find((*end)->child);
    if (found == running_.end()) {
      continue;
    }
    const Running running = std::move(found->second);
    running_.erase(found);
    return conclude(running, **end).map([&] { return running.task; });
  }
}

Expected<void> Executor::conclude(const Running& running, const ChildEnd& end) {
  const auto wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - running.begun).count();
  folder_.log_cost(running.task, end.processor_s, wall);
  auto concluded = [&]() -> Expected<void> {
    if (end.signal == SIGKILL || end.signal == SIGTERM) {
      return {};  // somebody's, or the machine's for want of memory: lost, and begun again
    }
    if (end.signal != 0 || !is_answer(folder_.task(running.task).step, end.exit_status)) {
      const bool refused = end.signal == 0 && (end.exit_status == static_cast<int>(ErrorKind::usage) ||
                                               end.exit_status == static_cast<int>(ErrorKind::bad_input));
      return failed_try(running.task, how_it_ended(end, running.scratch, bounds_.limit_s), refused);
    }
    const fs::path output = running.scratch / "output";
    std::error_code error;
    const auto printed = fs::exists(output, error) ? read_text_file(output, longest_output) : Expected<std::string>("");
    const auto result = printed.and_then(
        [&](const std::string& text) { return finish(folder_, running.task, running.scratch, end.exit_status, text); });
    if (!result) {
      return failed_try(running.task, result.error().message, result.error().kind == ErrorKind::bad_input);
    }
    return folder_.keep_result(running.task, *result);
  }();
  std::error_code ignored;
  fs::remove_all(running.scratch, ignored);
  return concluded;
}

Expected<void> Executor::failed_try(std::size_t task, const std::string& line, bool final) {
  if (auto noted = folder_.note_failed_try(task, line); !noted) {
    return noted;
  }
  const int failed = folder_.tries(task).failed;
  return final || failed >= bounds_.tries ? folder_.note_failed(task, line) : Expected<void>{};
}

Agenda::Agenda(const BatchFolder& folder, const std::vector<std::size_t>& tasks) {
  for (auto task = tasks.rbegin(); task != tasks.rend(); ++task) {
    if (folder.has_result(*task) || folder.failure(*task)) {
      continue;
    }
    std::size_t unmet = 0;
    for (const std::size_t need : folder.task(*task).needs) {
      if (!folder.has_result(need)) {
        waiting_for_[need].push_back(*task);
        ++unmet;
      }
    }
    if (unmet == 0) {
      ready_.push_back(*task);
    } else {
      unmet_[*task] = unmet;
    }
  }
}

std::optional<std::size_t> Agenda::next() {
  if (ready_.empty()) {
    return std::nullopt;
  }
  const std::size_t task = ready_.back();
  ready_.pop_back();
  return task;
}

void Agenda::put_back(std::size_t task) { ready_.insert(ready_.begin(), task); }

void Agenda::done(std::size_t task) {
  for (const std::size_t waiting : waiting_for_[task]) {
    if (--unmet_[waiting] == 0) {
      ready_.insert(ready_.begin(), waiting);
    }
  }
}

Expected<void> work_off(BatchFolder& folder, const std::vector<std::size_t>& tasks, std::size_t jobs,
                        const Bounds& bounds, const OnEnded& on_ended) {
  Executor executor(folder, bounds);
  Agenda agenda(folder, tasks);
  const auto settle = [&](std::size_t task) {
    if (folder.has_result(task)) {
      agenda.done(task);
    } else if (!folder.failure(task)) {
      agenda.put_back(task);
      return;
    }
    on_ended(task);
  };
  while (true) {
    while (executor.running() < jobs && !folder.paused()) {
      const auto task = agenda.next();
      if (!task) {
        break;
      }
      const std::size_t before = executor.running();
      if (auto started = executor.start(*task); !started) {
        return started;
      }
      if (executor.running() == before) {  // done already
        settle(*task);
      }
    }
    if (executor.running() == 0) {
      return {};
    }
    const auto ended = executor.wait();
    if (!ended) {
      return tl::unexpected(ended.error());
    }
    settle(*ended);
  }
}

}  // namespace selfcal::batch
