#include "daemon/run/imported_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/run/measured_parameters.hpp"
#include "daemon/store/run_summary.hpp"

namespace selfcal {

ImportedRun::ImportedRun(EventLoop& loop, RunStore& store, RunRecord record, InsConfig config,
                         std::function<void(const RunRecord&)> ended)
    : store_(store), record_(std::move(record)), config_(std::move(config)), ended_(std::move(ended)), worker_(loop) {}

void ImportedRun::begin(std::shared_ptr<const OpenFile> file, const std::filesystem::path& folder) {
  remember("imported", file ? fmt::format("from {}, by {}", record_.source, record_.user) : "taken up again");
  worker_.start(
      recording_job({std::move(file), folder, record_.serial, config_}), [](const CalibrationProgress&) {},
      [this](Expected<Estimate> answer) { on_estimate(std::move(answer)); });
}

void ImportedRun::on_estimate(Expected<Estimate> answer) {
  if (!answer) {
    return end(State::failed, static_cast<int>(answer.error().kind), answer.error().message);
  }
  for (const std::string& warning : answer->warnings) {
    remember("warning", warning);
  }
  if (const auto kept = keep(*answer); !kept) {
    return end(State::failed, static_cast<int>(kept.error().kind), kept.error().message);
  }
  for (const std::string& objection : answer->objections) {
    remember("gate", objection);
  }
  if (answer->objections.empty()) {
    return end(State::completed, 0, "");
  }
  end(State::refused, 1, fmt::format("{}", fmt::join(answer->objections, "; ")));
}

Expected<void> ImportedRun::keep(const Estimate& estimate) {
  record_.recording = estimate.recording;
  record_.result_json = estimate.result_json;
  const RunStore::Parameters parameters = measured_parameters(estimate.result);
  for (const std::string& text : history_warnings(store_, record_, record_.started_utc, parameters, config_.limit)) {
    remember("warning", text);
  }
  return store_.store_parameters(record_.id, parameters);
}

void ImportedRun::remember(const std::string& kind, const std::string& text) {
  journal::write(journal::Level::info, text, {record_.id, record_.ins, record_.serial, "", -1});
  if (const auto stored = store_.add_event(record_.id, {utc_now(), kind, text}); !stored) {
    journal::write(journal::Level::error, stored.error().message);
  }
}

// What was measured belongs to the time of the recording, not of its import.
void ImportedRun::end(State state, int exit_status, const std::string& reason) {
  record_.state = state;
  record_.exit_status = exit_status;
  record_.reason = reason;
  record_.ended_utc = record_.started_utc;
  if (const auto stored = store_.update_run(record_); !stored) {
    journal::write(journal::Level::error, stored.error().message);
  }
  const Summary summary = run_summary(store_, record_);
  journal::write(state == State::completed ? journal::Level::notice : journal::Level::error, summary.verdict,
                 {record_.id, record_.ins, record_.serial, std::string(name(state)), -1});
  ended_(record_);
}

}  // namespace selfcal
