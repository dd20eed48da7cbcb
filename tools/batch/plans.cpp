#include "tools/batch/plans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "protocol/recording/file_hash.hpp"
#include "tools/batch/step_work.hpp"

namespace selfcal::batch {
namespace {

namespace fs = std::filesystem;

Expected<void> add_program(Plan& plan, const std::string& name) {
  return sha256_of_file(program_folder() / name)
      .map_error([&](const Error& error) {
        return Error{ErrorKind::usage, name.find('/') == std::string::npos
                                           ? fmt::format("{} does not stand beside selfcal ({})", name, error.message)
                                           : error.message};
      })
      .map([&](const std::string& hash) { plan.programs[name] = hash; });
}

Expected<Planned> begun(std::string kind, std::initializer_list<Step> steps) {
  Planned planned;
  planned.plan.kind = std::move(kind);
  planned.plan.version = SELFCAL_VERSION;
  for (const Step step : steps) {
    if (const auto added = add_program(planned.plan, planned.plan.program_of(step)); !added) {
      return tl::unexpected(added.error());
    }
  }
  return planned;
}

// A program or a file that one uses: beside selfcal where it has no folder, else where the caller stands.
std::string named(const std::string& file) {
  return file.find('/') == std::string::npos ? file : fs::absolute(file).lexically_normal().string();
}

// Words for a step; those that name a file become its copy in the batch, which is named by content.
Expected<void> give_words(Planned& planned, Step step, std::vector<std::string> words) {
  for (std::string& word : words) {
    std::error_code error;
    if (!fs::is_regular_file(word, error)) {
      continue;
    }
    const auto hash = sha256_of_file(word);
    if (!hash) {
      return tl::unexpected(hash.error());
    }
    const std::string name = *hash + fs::path(word).extension().string();
    planned.inputs[name] = fs::absolute(word);
    word = "inputs/" + name;
  }
  planned.plan.words[std::string(name_of(step))] = std::move(words);
  return {};
}

bool is_recording(const fs::path& file) {
  const std::string name = file.filename().string(), ending = file.extension().string();
  return ending == ".h5" || ending == ".hdf5" || ending == ".csv" ||
         (name.size() == 64 && name.find_first_not_of("0123456789abcdef") == std::string::npos);
}

Expected<std::vector<fs::path>> recordings_in(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    std::error_code error;
    if (!fs::is_directory(name, error)) {
      files.push_back(fs::absolute(name));
      continue;
    }
    const std::size_t before = files.size();
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(name, error)) {
      if (entry.is_regular_file() && is_recording(entry.path())) {
        files.push_back(fs::absolute(entry.path()));
      }
    }
    if (error || files.size() == before) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", name, error ? error.message() : "holds no recording"));
    }
  }
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

Task numbered(Step step, std::uint64_t number, std::vector<std::size_t> needs = {}) {
  Task task;
  task.step = step;
  task.label = fmt::format("{} {}", name_of(step), number);
  task.number = number;
  task.needs = std::move(needs);
  return task;
}

Task single(Step step, std::vector<std::size_t> needs) {
  Task task;
  task.step = step;
  task.label = name_of(step);
  task.needs = std::move(needs);
  return task;
}

}  // namespace

std::vector<std::string> words_in(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    words.push_back(word);
  }
  return words;
}

Expected<Planned> plan_of_recordings(Step step, const std::vector<std::string>& recordings,
                                     const std::vector<std::string>& options) {
  const auto files = recordings_in(recordings);
  if (!files) {
    return tl::unexpected(files.error());
  }
  auto planned = begun(std::string(name_of(step)), {step});
  const auto given = planned ? give_words(*planned, step, options) : tl::unexpected(planned.error());
  if (!given) {
    return tl::unexpected(given.error());
  }
  std::map<std::string, fs::path> met;
  for (const fs::path& file : *files) {
    const auto hash = sha256_of_file(file);
    if (!hash) {
      return tl::unexpected(hash.error());
    }
    if (!met.emplace(*hash, file).second) {
      continue;  // the same recording under another name: one task
    }
    Task task;
    task.step = step;
    task.label = file.filename().string();
    task.recording = file.string();
    task.recording_sha256 = *hash;
    planned->plan.add(std::move(task));
  }
  return planned;
}

Expected<Planned> plan_of_trial(const Trial& trial) {
  Planned planned;
  Plan& plan = planned.plan;
  plan.kind = trial.kind;
  plan.version = SELFCAL_VERSION;
  std::vector<std::string> files = trial.uses;
  for (const auto& [step, words] : {std::pair(Step::draw, trial.draw), std::pair(Step::answer, trial.answer)}) {
    if (words.empty()) {
      return fail(ErrorKind::usage, fmt::format("--{}: names no program", name_of(step)));
    }
    plan.trial_programs[std::string(name_of(step))] = named(words.front());
    files.push_back(words.front());
    if (const auto given = give_words(planned, step, {words.begin() + 1, words.end()}); !given) {
      return tl::unexpected(given.error());
    }
  }
  if (!trial.scorer.empty()) {
    plan.trial_programs["score"] = fs::absolute(trial.scorer).lexically_normal().string();
    files.push_back(plan.trial_programs["score"]);
  }
  for (const std::string& file : files) {
    if (const auto added = add_program(plan, named(file)); !added) {
      return tl::unexpected(added.error());
    }
  }
  std::vector<std::size_t> drawn, answered;
  for (std::uint64_t n = 0; n < trial.cases; ++n) {
    drawn.push_back(plan.add(numbered(Step::draw, n)));
  }
  const std::size_t sealed = plan.add(single(Step::seal, drawn));
  for (std::uint64_t n = 0; n < trial.cases; ++n) {
    answered.push_back(plan.add(numbered(Step::answer, n, {drawn[n], sealed})));
  }
  plan.add(single(Step::score, answered));
  return planned;
}

Expected<Planned> plan_of_monte_carlo(const MonteCarlo& trial) {
  auto planned = begun("monte-carlo", {Step::simulate, Step::estimate});
  auto given = planned ? give_words(*planned, Step::simulate, trial.simulation) : tl::unexpected(planned.error());
  if (given) {
    given = give_words(*planned, Step::estimate, trial.options);
  }
  if (!given) {
    return tl::unexpected(given.error());
  }
  Plan& plan = planned->plan;
  std::vector<std::size_t> estimated;
  for (std::uint64_t n = 0; n < trial.runs; ++n) {
    const std::size_t simulated = plan.add(numbered(Step::simulate, trial.seed + n));
    estimated.push_back(plan.add(numbered(Step::estimate, trial.seed + n, {simulated})));
  }
  plan.add(single(Step::statistics, estimated));
  return planned;
}

}  // namespace selfcal::batch
