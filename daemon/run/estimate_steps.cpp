#include "daemon/run/estimate_steps.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ctime>

#include "daemon/estimate/coefficient_set.hpp"
#include "daemon/estimate/estimate_job.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/run/ins_checks.hpp"
#include "daemon/run/measured_parameters.hpp"

namespace selfcal {

void EstimateSteps::estimate() {
  running_.drop_current();
  estimators_.start(
      journal_.record.amends == 0
          ? estimate_job({data_.folder, journal_.record.rotation, journal_.record.serial, journal_.record.started_utc,
                          data_.schedule, data_.config})
          : amendment_job({kept_recording(journal_.record.amends), further_recordings(), data_.folder, data_.config}),
      [this](const CalibrationProgress& progress) { on_estimate_progress(progress); },
      [this](Expected<Estimate> answer) { on_estimate(std::move(answer)); });
}

// An empty path where the store cannot say: the job's error names the run then.
KeptRecording EstimateSteps::kept_recording(RunId run) const {
  const auto found = store_.run(run);
  return {run, found && *found ? std::filesystem::path((*found)->recording) : std::filesystem::path()};
}

std::vector<KeptRecording> EstimateSteps::further_recordings() const {
  std::vector<KeptRecording> all;
  for (const RunId run : journal_.record.amends_with) {
    all.push_back(kept_recording(run));
  }
  return all;
}

void EstimateSteps::on_estimate_progress(const CalibrationProgress& progress) {
  progressed();
  journal_.progress.pass = progress.pass;
  journal_.progress.pass_fraction = progress.fraction;
  journal_.progress.running = false;
  if (journal_.record.amends == 0) {
    journal_.show_estimate(progress.value, progress.sigma);
  }
  journal_.report_progress();
}

void EstimateSteps::on_estimate(Expected<Estimate> answer) {
  if (!answer) {
    journal_.fail_with(answer.error().message, answer.error().kind);
    return post_(Event::step_failed);
  }
  data_.estimate = std::move(*answer);
  for (const std::string& warning : data_.estimate->warnings) {
    journal_.warn(warning);
  }
  for (const std::string& note : data_.estimate->notes) {
    journal_.remember("amendment", note);
  }
  post_(Event::estimate_ready);
}

void EstimateSteps::judge() {
  data_.objections = data_.estimate->objections;
  if (auto stored = store_result(); !stored) {
    journal_.fail_with(stored.error().message, stored.error().kind);
    return post_(Event::step_failed);
  }
  for (const std::string& objection : data_.objections) {
    journal_.remember("gate", objection);
  }
  if (!data_.objections.empty() && !journal_.record.force_reason.empty()) {
    journal_.warn(fmt::format("written against the gate ({}), for: {}", fmt::join(data_.objections, "; "),
                              journal_.record.force_reason));
  }
  post_(Event::judged);
}

Expected<void> EstimateSteps::store_result() {
  const RunStore::Parameters parameters = measured_parameters(data_.estimate->result);
  journal_.show_estimate(data_.estimate->result.value, data_.estimate->result.sigma);
  for (const std::string& text : history_warnings(store_, journal_.record, utc_now(), parameters, data_.config.limit)) {
    journal_.warn(text);
  }
  journal_.record.recording = data_.estimate->recording;
  journal_.record.result_json = data_.estimate->result_json;
  if (auto stored = store_.store_parameters(journal_.record.id, parameters); !stored) {
    return stored;
  }
  return make_new_set();
}

// A value that is undetermined or physically impossible is never pushed, whatever the operator's reason: the one in
// force stays, and the story says so.
Expected<void> EstimateSteps::make_new_set() {
  const auto previous = store_.set(journal_.record.id, SetRole::previous);
  if (!previous) {
    return tl::unexpected(previous.error());
  }
  if (!*previous) {
    return fail(ErrorKind::internal, fmt::format("run {}: the set in force was not kept", journal_.record.id));
  }
  const auto in_force = ins::decode_coefficients(**previous);
  if (!in_force) {
    return tl::unexpected(in_force.error());
  }
  const CoefficientSet measured =
      coefficient_set(data_.estimate->result, data_.objections.empty(), journal_.record.serial, utc_now());
  std::vector<std::string_view> kept;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    if (!measured.determined[i]) {
      kept.push_back(sensor_parameters[i].name);
    }
  }
  if (!kept.empty()) {
    journal_.remember("gate", fmt::format("never written, the value in force stays: {}", fmt::join(kept, ", ")));
  }
  ins::Coefficients fresh;
  fresh.version = in_force->version + 1;
  fresh.date_s = std::time(nullptr);
  fresh.author =
      fmt::format("selfcal run {} {}", journal_.record.id, journal_.record.user).substr(0, ins::author_bytes);
  fresh.value = merged_with_in_force(measured, in_force->value);
  if (const Complaint complaint =
          check_coefficients(fresh.value, "the set to be written, where the one in force stays")) {
    if (!journal_.record.dry_run && (data_.objections.empty() || !journal_.record.force_reason.empty())) {
      return fail(ErrorKind::device, fmt::format("{}: {}", data_.config.interface, *complaint));
    }
    journal_.remember("gate", *complaint);
  }
  const auto bytes = ins::encode(fresh);
  data_.new_set.assign(bytes.begin(), bytes.end());
  return store_.store_set(journal_.record.id, SetRole::written, data_.new_set);
}

}  // namespace selfcal
