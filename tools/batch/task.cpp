#include "tools/batch/task.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "protocol/recording/file_hash.hpp"

namespace selfcal::batch {
namespace {

using Json = nlohmann::ordered_json;

struct StepRow {
  Step step;
  std::string_view name, program;
};

// A trial's plan names the programs that draw, answer and score.
constexpr std::array<StepRow, 8> steps = {{{Step::estimate, "estimate", "selfcal"},
                                           {Step::diagnose, "diagnose", "selfcal"},
                                           {Step::draw, "draw", ""},
                                           {Step::seal, "seal", ""},
                                           {Step::answer, "answer", ""},
                                           {Step::score, "score", ""},
                                           {Step::simulate, "simulate", "selfcal"},
                                           {Step::statistics, "statistics", ""}}};

const StepRow& row_of(Step step) {
  return *std::find_if(steps.begin(), steps.end(), [&](const StepRow& row) { return row.step == step; });
}

// Of the step's program, and in a trial of all files that one is used with: which step uses which nobody says.
Json hashes_of(const Plan& plan, Step step) {
  const std::string program = plan.program_of(step);
  if (program.empty()) {
    return "";
  }
  if (!plan.trial_programs.contains(std::string(name_of(step)))) {
    return plan.programs.at(program);
  }
  Json hashes = {plan.programs.at(program)};
  if (step == Step::score) {
    return hashes;
  }
  for (const auto& [name, hash] : plan.programs) {
    const bool other_step = std::any_of(plan.trial_programs.begin(), plan.trial_programs.end(),
                                        [&, &name = name](const auto& entry) { return entry.second == name; });
    if (!other_step) {
      hashes.push_back(hash);
    }
  }
  std::sort(hashes.begin() + 1, hashes.end());
  return hashes;
}

// All that a result follows from. The recording's name and place are none of it.
std::string key_of(const Plan& plan, const Task& task) {
  Json content = {{"step", name_of(task.step)},
                  {"version", plan.version},
                  {"program", hashes_of(plan, task.step)},
                  {"words", plan.words_of(task.step)},
                  {"recording", task.recording_sha256},
                  {"number", task.number},
                  {"needs", Json::array()}};
  for (const std::size_t need : task.needs) {
    content["needs"].push_back(plan.tasks[need].key);
  }
  return sha256_of_text(content.dump());
}

}  // namespace

std::string_view name_of(Step step) { return row_of(step).name; }

Expected<Step> step_called(std::string_view name) {
  const auto row = std::find_if(steps.begin(), steps.end(), [&](const StepRow& r) { return r.name == name; });
  if (row == steps.end()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: no step of a batch", name));
  }
  return row->step;
}

std::size_t Plan::add(Task task) {
  for (const std::size_t need : task.needs) {
    task.level = std::max(task.level, tasks[need].level + 1);
  }
  task.key = key_of(*this, task);
  tasks.push_back(std::move(task));
  return tasks.size() - 1;
}

std::string Plan::identity() const {
  std::string keys;
  for (const Task& task : tasks) {
    keys += task.key;
  }
  return sha256_of_text(keys);
}

int Plan::levels() const {
  int highest = -1;
  for (const Task& task : tasks) {
    highest = std::max(highest, task.level);
  }
  return highest + 1;
}

const std::vector<std::string>& Plan::words_of(Step step) const {
  static const std::vector<std::string> none;
  const auto found = words.find(std::string(name_of(step)));
  return found == words.end() ? none : found->second;
}

std::string Plan::program_of(Step step) const {
  const auto own = trial_programs.find(std::string(name_of(step)));
  return own != trial_programs.end() ? own->second : std::string(row_of(step).program);
}

Json to_json(const Plan& plan) {
  Json document = {{"schema", {{"name", "selfcal.batch_plan"}, {"version", 2}}},
                   {"kind", plan.kind},
                   {"version", plan.version},
                   {"programs", plan.programs},
                   {"trial_programs", plan.trial_programs},
                   {"words", plan.words},
                   {"tasks", Json::array()}};
  for (const Task& task : plan.tasks) {
    document["tasks"].push_back({{"key", task.key},
                                 {"step", name_of(task.step)},
                                 {"label", task.label},
                                 {"recording", task.recording},
                                 {"recording_sha256", task.recording_sha256},
                                 {"number", task.number},
                                 {"needs", task.needs}});
  }
  return document;
}

// Keys are computed again: a plan that was edited is refused.
Expected<Plan> plan_from_json(const Json& document) {
  try {
    Plan plan{document.at("kind"),           document.at("version"), document.at("programs"),
              document.at("trial_programs"), document.at("words"),   {}};
    for (const Json& entry : document.at("tasks")) {
      const auto step = step_called(entry.at("step").get<std::string>());
      if (!step) {
        return tl::unexpected(step.error());
      }
      Task task{{},
                *step,
                entry.at("label"),
                entry.at("recording"),
                entry.at("recording_sha256"),
                entry.at("number"),
                entry.at("needs")};
      const bool ordered =
          std::all_of(task.needs.begin(), task.needs.end(), [&](std::size_t need) { return need < plan.tasks.size(); });
      if (!ordered || plan.tasks[plan.add(std::move(task))].key != entry.at("key").get<std::string>()) {
        return fail(ErrorKind::bad_input, fmt::format("task {}: its key does not follow from the plan",
                                                      entry.at("label").get<std::string>()));
      }
    }
    return plan;
  } catch (const nlohmann::json::exception& error) {
    return fail(ErrorKind::bad_input, fmt::format("no plan of a batch: {}", error.what()));
  }
}

}  // namespace selfcal::batch
