#include "tools/batch/step_work.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/hub/recording_folder.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/file_hash.hpp"
#include "tools/batch/statistics.hpp"

namespace selfcal::batch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Words = std::vector<std::string>;

constexpr std::size_t longest_file = 500'000'000;

Words joined(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// The recording of a task: its own, or the one that its first need made.
Expected<std::string> recording_of(const BatchFolder& folder, const Task& task) {
  if (!task.recording.empty()) {
    return task.recording;
  }
  return folder.result(task.needs.front()).map([&](const Json& made) {
    return hub::recording_path(folder.path() / "recordings", made.at("recording").get<std::string>()).string();
  });
}

// What a need of this step answered, joined as lines to FILE.
Expected<std::string> join(const BatchFolder& folder, const Task& task, Step step, const char* field,
                           const fs::path& file) {
  std::string text;
  for (const std::size_t need : task.needs) {
    if (folder.task(need).step == step) {
      const auto result = folder.result(need);
      if (!result) {
        return tl::unexpected(result.error());
      }
      text += result->at(field).dump() + "\n";
    }
  }
  return write_file_atomically(file, text).map([&] { return text; });
}

// Times that a program took are no part of its answer, and a recording's place is none.
void forget_circumstances(Json& answer) {
  for (const char* time : {"elapsed_s", "cpu_s", "seconds"}) {
    answer.erase(time);
  }
  if (answer.contains("passes") && answer["passes"].is_array()) {
    for (Json& pass : answer["passes"]) {
      pass.erase("seconds");
    }
  }
  if (answer.contains("input") && answer["input"].contains("name")) {
    answer["input"]["name"] = fs::path(answer["input"]["name"].get<std::string>()).filename().string();
  }
}

// Into the folder of recordings, by content.
Expected<std::string> keep_made(const BatchFolder& folder, const fs::path& scratch) {
  return hub::keep_recording(scratch / "made.h5", folder.path() / "recordings").map([](const hub::KeptRecording& kept) {
    return kept.sha256;
  });
}

Expected<Json> finish_own(const BatchFolder& folder, const Task& task, const std::string& output) {
  if (task.step == Step::statistics) {
    return calibration_statistics(folder, task);
  }
  if (task.step == Step::score) {
    const bool scored = !folder.plan().program_of(Step::score).empty();
    return sha256_of_file(folder.path() / "answers.jsonl").map([&](const std::string& hash) {
      return Json{{"answers_sha256", hash}, {"text", scored ? Json(output) : Json()}};
    });
  }
  return join(folder, task, Step::draw, "case", folder.path() / "key.jsonl").map([](const std::string& text) {
    return Json{{"key_sha256", sha256_of_text(text)}};
  });
}

Expected<Json> finish_made(const BatchFolder& folder, const fs::path& scratch, Json answer) {
  const auto kept = keep_made(folder, scratch);
  if (!kept) {
    return tl::unexpected(kept.error());
  }
  answer["recording"] = *kept;
  return answer;
}

Expected<Json> finish_printed(const BatchFolder& folder, const Task& task, const fs::path& scratch,
                              const std::string& output) {
  Json answer = Json::parse(output, nullptr, false);
  if (!answer.is_object()) {
    return fail(ErrorKind::internal, "it printed no JSON document");
  }
  if (task.step == Step::draw) {
    return finish_made(folder, scratch, std::move(answer));
  }
  if (task.step == Step::answer) {
    forget_circumstances(answer);
    Json numbered = {{"number", task.number}};
    numbered.update(answer);
    return Json{{"answer", numbered}};
  }
  if (!task.recording_sha256.empty() && answer["input"]["sha256"] != task.recording_sha256) {
    return fail(ErrorKind::bad_input, fmt::format("{}: has changed since the batch was planned", task.recording));
  }
  forget_circumstances(answer);
  return Json{{"answer", std::move(answer)}};
}

}  // namespace

fs::path program_folder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

Expected<void> check_programs(const Plan& plan) {
  for (const auto& [name, sha256] : plan.programs) {
    const auto here = sha256_of_file(program_folder() / name);
    if (!here) {
      return tl::unexpected(here.error());
    }
    if (*here != sha256) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: another build than the batch was planned with", (program_folder() / name).string()));
    }
  }
  return {};
}

Expected<Words> command_of(const BatchFolder& folder, std::size_t index, const fs::path& scratch) {
  const Task& task = folder.task(index);
  const Words& more = folder.plan().words_of(task.step);
  const std::string named = folder.plan().program_of(task.step);
  if (task.step == Step::score) {
    return join(folder, task, Step::answer, "answer", folder.path() / "answers.jsonl").map([&](const std::string&) {
      return named.empty() ? Words{} : Words{named, folder.path().string()};
    });
  }
  if (named.empty()) {
    return Words{};
  }
  const std::string program = (program_folder() / named).string();
  if (task.step == Step::draw) {
    return joined(joined({program}, more), {std::to_string(task.number), (scratch / "made.h5").string()});
  }
  if (task.step == Step::simulate) {
    return joined(joined({program, "simulate"}, more),
                  {"--seed", std::to_string(task.number), "--truth", (scratch / "truth.json").string(), "--output",
                   (scratch / "made.h5").string()});
  }
  const auto recording = recording_of(folder, task);
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  if (task.step == Step::answer) {
    return folder.result(task.needs.front()).map([&](const Json& drawn) {
      return joined(joined({program}, more),
                    drawn.contains("assumed") ? Words{*recording, drawn["assumed"].dump()} : Words{*recording});
    });
  }
  return joined(joined({program, std::string(name_of(task.step)), "--json"}, more), {*recording});
}

Expected<std::string> finish(const BatchFolder& folder, std::size_t index, const fs::path& scratch, int exit_status,
                             const std::string& output) {
  const Task& task = folder.task(index);
  Expected<Json> body = Json{};
  if (task.step == Step::score || folder.plan().program_of(task.step).empty()) {
    body = finish_own(folder, task, output);
  } else if (task.step == Step::simulate) {
    body = read_text_file(scratch / "truth.json", longest_file).and_then([&](const std::string& truth) {
      return finish_made(folder, scratch, Json{{"truth", Json::parse(truth, nullptr, false)}});
    });
  } else {
    body = finish_printed(folder, task, scratch, output);
  }
  return body.map([&](const Json& fields) {
    Json result = {{"schema", {{"name", "selfcal.batch_result"}, {"version", 1}}},
                   {"key", task.key},
                   {"step", name_of(task.step)},
                   {"version", folder.plan().version},
                   {"exit_status", exit_status}};
    result.update(fields);
    return result.dump() + "\n";
  });
}

}  // namespace selfcal::batch
