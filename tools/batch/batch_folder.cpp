#include "tools/batch/batch_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "protocol/recording/atomic_file.hpp"

namespace selfcal::batch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t longest_file = 500'000'000;

// One line, in one write: whole also where several machines append.
Expected<void> append(const fs::path& file, const std::string& line) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  const std::string text = line + "\n";
  const bool good = descriptor >= 0 && ::write(descriptor, text.data(), text.size()) == std::ssize(text);
  const int cause = errno;
  if (descriptor >= 0) {
    ::close(descriptor);
  }
  if (!good) {
    return fail(ErrorKind::device, fmt::format("{}: cannot be written: {}", file.string(), std::strerror(cause)));
  }
  return {};
}

Expected<Json> read_json(const fs::path& file) {
  return read_text_file(file, longest_file).and_then([&](const std::string& text) -> Expected<Json> {
    Json document = Json::parse(text, nullptr, false);
    if (document.is_discarded()) {
      return fail(ErrorKind::bad_input, fmt::format("{}: no JSON", file.string()));
    }
    return document;
  });
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

Expected<BatchFolder> BatchFolder::create(const fs::path& folder, const Plan& plan) {
  const std::string text = to_json(plan).dump(1) + "\n";
  std::error_code error;
  const fs::path path = fs::absolute(folder);
  if (fs::exists(path / "plan.json", error)) {
    auto known = open(path);
    if (known && to_json(known->plan()).dump(1) + "\n" != text) {
      return fail(ErrorKind::usage, fmt::format("{}: holds another batch, or one of another program", path.string()));
    }
    return known;
  }
  for (const char* name : {"results", "tries", "failed", "work", "recordings", "inputs", "log", "slurm"}) {
    fs::create_directories(path / name, error);
    if (error) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", (path / name).string(), error.message()));
    }
  }
  if (auto written = write_file_atomically(path / "plan.json", text); !written) {
    return tl::unexpected(written.error());
  }
  return BatchFolder(path, plan);
}

Expected<BatchFolder> BatchFolder::open(const fs::path& folder) {
  const fs::path path = fs::absolute(folder);
  return read_json(path / "plan.json")
      .and_then(plan_from_json)
      .map([&](Plan plan) { return BatchFolder(path, std::move(plan)); })
      .map_error([&](const Error& error) {
        return Error{error.kind, fmt::format("{}: no batch: {}", folder.string(), error.message)};
      });
}

fs::path BatchFolder::result_path(std::size_t index) const {
  const std::string& key = task(index).key;
  return path_ / "results" / key.substr(0, 2) / (key + ".json");
}

bool BatchFolder::has_result(std::size_t index) const {
  std::error_code error;
  return fs::exists(result_path(index), error);
}

Expected<Json> BatchFolder::result(std::size_t index) const { return read_json(result_path(index)); }

Expected<void> BatchFolder::keep_result(std::size_t index, const std::string& text) {
  const fs::path target = result_path(index);
  if (has_result(index)) {
    const auto known = read_text_file(target, longest_file);
    if (known && *known != text) {
      return fail(ErrorKind::internal, fmt::format("task {}: its result differs from the one that is there: {}",
                                                   task(index).label, target.string()));
    }
    return known.map([](const std::string&) {});
  }
  std::error_code error;
  fs::create_directories(target.parent_path(), error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", target.parent_path().string(), error.message()));
  }
  return write_file_atomically(target, text);
}

Tries BatchFolder::tries(std::size_t index) const {
  Tries tries;
  std::ifstream file(path_ / "tries" / task(index).key);
  for (std::string line; std::getline(file, line);) {
    tries.begun += line.starts_with("begun ") ? 1 : 0;
    if (line.starts_with("failed ")) {
      ++tries.failed;
      tries.line = line.substr(7);
    }
  }
  return tries;
}

Expected<void> BatchFolder::note_begun(std::size_t index) {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  return append(path_ / "tries" / task(index).key, fmt::format("begun {} {}", host, ::getpid()));
}

Expected<void> BatchFolder::note_failed_try(std::size_t index, const std::string& line) {
  return append(path_ / "tries" / task(index).key, "failed " + one_line(line));
}

Expected<void> BatchFolder::note_failed(std::size_t index, const std::string& line) {
  return write_file_atomically(path_ / "failed" / task(index).key, one_line(line) + "\n");
}

std::optional<std::string> BatchFolder::failure(std::size_t index) const {
  std::ifstream file(path_ / "failed" / task(index).key);
  std::string line;
  return file && std::getline(file, line) ? std::optional(line) : std::nullopt;
}

Expected<void> BatchFolder::forget_failures() {
  std::error_code error;
  for (const Task& task : plan_.tasks) {
    if (fs::remove(path_ / "failed" / task.key, error) && !error) {
      fs::remove(path_ / "tries" / task.key, error);
    }
    if (error) {
      return fail(ErrorKind::device, fmt::format("{}: {}", (path_ / "failed" / task.key).string(), error.message()));
    }
  }
  return {};
}

std::vector<State> BatchFolder::states() const {
  std::vector<State> states;
  std::error_code error;
  for (std::size_t i = 0; i < plan_.tasks.size(); ++i) {
    const auto& needs = task(i).needs;
    State state = State::open;
    if (has_result(i)) {
      state = State::done;
    } else if (fs::exists(path_ / "failed" / task(i).key, error)) {
      state = State::failed;
    } else if (std::any_of(needs.begin(), needs.end(), [&](std::size_t need) {
                 return states[need] == State::failed || states[need] == State::blocked;
               })) {
      state = State::blocked;
    }
    states.push_back(state);
  }
  return states;
}

bool BatchFolder::paused() const {
  std::error_code error;
  return fs::exists(path_ / "paused", error);
}

Expected<void> BatchFolder::pause(bool on) {
  if (on) {
    return write_file_atomically(path_ / "paused", "");
  }
  std::error_code error;
  fs::remove(path_ / "paused", error);
  if (error) {
    return fail(ErrorKind::device, fmt::format("{}: {}", (path_ / "paused").string(), error.message()));
  }
  return {};
}

Expected<std::shared_ptr<void>> BatchFolder::lock() const {
  const fs::path file = path_ / "lock";
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) {
    return fail(ErrorKind::device, fmt::format("{}: {}", file.string(), std::strerror(errno)));
  }
  // The object is the descriptor's keeper; it points at nothing that is read.
  std::shared_ptr<void> keeper(nullptr, [descriptor](void*) { ::close(descriptor); });
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    return fail(ErrorKind::usage, fmt::format("{}: another selfcal batch drives it", path_.string()));
  }
  return keeper;
}

void BatchFolder::log_cost(std::size_t index, double processor_s, double wall_s) {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  // A cost that cannot be noted fails nothing.
  static_cast<void>(append(path_ / "log" / fmt::format("{}-{}", host, ::getpid()),
                           fmt::format("{} {:.6f} {:.6f}", task(index).key, processor_s, wall_s)));
}

double BatchFolder::processor_s() const {
  double sum = 0.0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path_ / "log", error)) {
    std::ifstream file(entry.path());
    std::string key;
    for (double processor = 0.0, wall = 0.0; file >> key >> processor >> wall;) {
      sum += processor;
    }
  }
  return sum;
}

Counts count(const std::vector<State>& states) {
  const auto of = [&](State state) {
    return static_cast<std::size_t>(std::count(states.begin(), states.end(), state));
  };
  return {of(State::done), of(State::failed), of(State::blocked), of(State::open)};
}

}  // namespace selfcal::batch
