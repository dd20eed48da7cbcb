#include "daemon/run/run_journal.hpp"

#include <fmt/format.h>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/store/run_summary.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto report_interval = 200ms;
constexpr auto bus_event_interval = 10s;  // the same is not reported more often

// What an operator should know at once; the rest is for the story of the run.
bool alarming(can::BusEvent event) {
  return event == can::BusEvent::bus_off || event == can::BusEvent::restarted ||
         event == can::BusEvent::error_passive || event == can::BusEvent::controller_overrun;
}

journal::Fields journal_fields(const RunRecord& run) {
  return {run.id, run.ins, run.serial, std::string(name(run.state)), -1};
}

}  // namespace

RunJournal::RunJournal(Timers& timers, RunStore& store, const InsPort& port, RunObserver& observer, RunRecord run)
    : record(std::move(run)), timers_(timers), store_(store), port_(port), observer_(observer) {
  progress.run = record.id;
  progress.state = record.state;
}

Expected<void> RunJournal::store_record() {
  auto stored = store_.update_run(record);
  if (stored || storage_lost_) {
    return {};
  }
  storage_lost_ = true;
  return stored;
}

void RunJournal::remember(const std::string& kind, const std::string& text) {
  journal::write(kind == "error" ? journal::Level::error : journal::Level::info, text, journal_fields(record));
  if (storage_lost_) {
    return;
  }
  if (auto stored = store_.add_event(record.id, {utc_now(), kind, text}); !stored) {
    journal::write(journal::Level::error, stored.error().message, journal_fields(record));
  }
}

void RunJournal::warn(const std::string& text) {
  remember("warning", text);
  observer_.on_warning(record, text);
}

void RunJournal::fail_with(const std::string& reason, ErrorKind kind) {
  if (!failed_) {
    failed_ = true;
    failure_status_ = static_cast<int>(kind);
    record.reason = reason;
  }
  remember("error", reason);
}

void RunJournal::report_progress(bool at_once) {
  const SteadyTime now = timers_.now();
  if (!at_once && now - reported_at_ < report_interval) {
    return;
  }
  reported_at_ = now;
  progress.lost_frames = port_.lost_frames();
  observer_.on_progress(record);
}

void RunJournal::report_state() { observer_.on_state(record); }

void RunJournal::show_estimate(const ParameterVector& value, const ParameterVector& sigma) {
  progress.estimate_known = true;
  progress.tolerances_met = 0;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    progress.value[i] = value(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
    progress.sigma[i] = sigma(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
    if (progress.sigma[i] <= progress.tolerance[i]) {
      ++progress.tolerances_met;
    }
  }
}

void RunJournal::on_bus_event(can::BusEvent event) {
  if (is_final(record.state)) {
    return;
  }
  BusEventCount& seen = bus_events_[event];
  const SteadyTime now = timers_.now();
  const bool first = ++seen.count == 1;
  if (!first && now - seen.said_at < bus_event_interval) {
    return;
  }
  seen.said_at = now;
  std::string text = fmt::format("{}: {}", port_.interface(), can::name(event));
  if (!first) {
    text += fmt::format(", {} times in this run", seen.count);
  }
  alarming(event) ? warn(text) : remember("bus", text);
}

void RunJournal::sum_up_bus_events() {
  std::string text;
  for (const auto& [event, seen] : bus_events_) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", seen.count, can::name(event));
  }
  if (!text.empty()) {
    remember("bus", fmt::format("{}: error frames in this run: {}", port_.interface(), text));
  }
}

void RunJournal::conclude() {
  sum_up_bus_events();
  const bool well = record.state == State::completed;
  journal::Fields fields = journal_fields(record);
  fields.nrc = last_nrc;
  progress.summary = run_summary(store_, record);
  journal::write(well ? journal::Level::notice : journal::Level::error,
                 fmt::format("{}{}{}", progress.summary.verdict, progress.summary.cause.empty() ? "" : " ",
                             progress.summary.cause),
                 fields);
  report_progress(true);
  observer_.on_state(record);
  observer_.on_finished(record);
}

}  // namespace selfcal
