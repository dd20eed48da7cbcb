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

constexpr std::array<StepRow, 8> steps = {{{Step::estimate, "estimate", "selfcal"},
                                           {Step::diagnose, "diagnose", "selfcal"},
                                           {Step::draw, "draw", "selfcal_blind_generate"},
                                           {Step::seal, "seal", ""},
                                           {Step::answer, "answer", "selfcal_blind_answer"},
                                           {Step::score, "score", ""},
                                           {Step::simulate, "simulate", "selfcal"},
                                           {Step::statistics, "statistics", ""}}};

const StepRow& row_of(Step step) {
  return *std::find_if(steps.begin(), steps.end(), [&](const StepRow& row) { return row.step == step; });
}

// All that a result follows from. The recording's name and place are none of it.
std::string key_of(const Plan& plan, const Task& task) {
  const std::string program = program_of(task.step);
  const auto hash = plan.programs.find(program);
  Json content = {{"step", name_of(task.step)},
                  {"version", plan.version},
                  {"program", hash == plan.programs.end() ? "" : hash->second},
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

std::string program_of(Step step) { return std::string(row_of(step).program); }

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

Json to_json(const Plan& plan) {
  Json document = {{"schema", {{"name", "selfcal.batch_plan"}, {"version", 1}}},
                   {"kind", plan.kind},
                   {"version", plan.version},
                   {"programs", plan.programs},
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
    Plan plan{document.at("kind"), document.at("version"), document.at("programs"), document.at("words"), {}};
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
