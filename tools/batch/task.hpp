// A batch: the same work on many recordings, cut into tasks. A task is known by its key, and its result follows from what
// the key is made of; so a result that is there is never made again, whoever made it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::batch {

enum class Step {
  estimate,    // selfcal estimate of a recording, or of a simulated one
  diagnose,    // selfcal diagnose of a recording
  draw,        // a trial's case and its recording
  seal,        // a trial's key, joined from the cases
  answer,      // what is answered to a trial's case
  score,       // a trial's answers joined, and counted by the scorer where one is given
  simulate,    // Monte Carlo: a recording and what is true of it
  statistics,  // Monte Carlo: errors against sigmas
};

std::string_view name_of(Step step);
// An error (bad_input) where there is no such step.
Expected<Step> step_called(std::string_view name);

struct Task {
  std::string key;  // SHA-256, 64 hexadecimal digits
  Step step = Step::estimate;
  std::string label;             // for people: the recording's name, or "simulate 12"
  std::string recording;         // absolute path; empty: none, or of the first need
  std::string recording_sha256;  // as it was when the batch was planned; empty: none
  std::uint64_t number = 0;      // of a case or run
  std::vector<std::size_t> needs;
  int level = 0;  // 0: needs nothing; else one more than the highest of its needs
};

struct Plan {
  std::string kind;     // estimate, diagnose, trial, monte-carlo
  std::string version;  // of the program that planned
  // SHA-256 of each program that a step runs, and of each file that such a program uses: another build is another program. A
  // name without a folder stands beside selfcal; else the path is absolute.
  std::map<std::string, std::string> programs;
  // Of a trial: the program of the steps draw, answer and score, named as in `programs`.
  std::map<std::string, std::string> trial_programs;
  // Words that a step's program gets besides what the task says.
  std::map<std::string, std::vector<std::string>> words;
  std::vector<Task> tasks;  // a task stands behind its needs

  // Appends a task with the key and level that follow from the rest; returns its place.
  std::size_t add(Task task);
  int levels() const;
  std::string identity() const;  // SHA-256 of its tasks' keys: the same batch in whatever folder
  const std::vector<std::string>& words_of(Step step) const;
  // Program that a step runs, named as in `programs`; empty: none.
  std::string program_of(Step step) const;
};

nlohmann::ordered_json to_json(const Plan& plan);
Expected<Plan> plan_from_json(const nlohmann::ordered_json& document);

}  // namespace selfcal::batch
