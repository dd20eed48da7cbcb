#include "daemon/run/calibration_run.hpp"

#include <fmt/format.h>

#include "daemon/estimate/estimate_job.hpp"
#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/store/run_summary.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto report_interval = 200ms;
constexpr auto bus_event_interval = 10s;  // the same is not said more often

// What an operator should know at once; the rest is for the story of the run.
bool alarming(can::BusEvent event) {
  return event == can::BusEvent::bus_off || event == can::BusEvent::restarted ||
         event == can::BusEvent::error_passive || event == can::BusEvent::controller_overrun;
}

journal::Fields journal_fields(const RunRecord& run) {
  return {run.id, run.ins, run.serial, std::string(name(run.state)), -1};
}

}  // namespace

CalibrationRun::CalibrationRun(RunContext context, InsConfig config, Schedule schedule, UnlockKey key, RunRecord record,
                               std::filesystem::path folder)
    : context_(context),
      config_(std::move(config)),
      schedule_(std::move(schedule)),
      key_(key),
      record_(std::move(record)),
      folder_(std::move(folder)),
      client_(context_.timers, context_.port),
      session_end_(context_.timers, context_.port),
      budget_(context_.timers, config_, [this](double waited_s) { budget_spent(waited_s); }),
      running_(context_.timers, context_.estimators, config_.running_estimate_s) {
  progress_.run = record_.id;
  progress_.state = record_.state;
  progress_.positions = static_cast<int>(schedule_.positions.size());
  const ParameterVector tolerance = calibration_options(config_).tolerance;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    progress_.tolerance[i] = tolerance(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
  }
  context_.port.on_status = [this](const ins::Status& status) { on_status(status); };
  context_.port.on_bus_event = [this](can::BusEvent event) { on_bus_event(event); };
}

CalibrationRun::~CalibrationRun() {
  context_.port.on_status = {};
  context_.port.on_bus_event = {};
  context_.port.keep_session(false);
  context_.timers.cancel(event_timer_);
  context_.estimators.cancel();
}

void CalibrationRun::begin() {
  budget_.begin(record_.state);
  post(Event::begin);
}

void CalibrationRun::resume() {
  commit_asked_ = record_.state == State::committing;  // perhaps, by the daemon that is gone
  budget_.begin(record_.state);
  remember("resume", fmt::format("the daemon was restarted while {}", words(record_.state)));
  if (const auto kept = context_.store.set(record_.id, SetRole::written); kept && *kept) {
    new_set_ = **kept;
  }
  // Estimating and judging need no INS, only the pages on disk.
  if (record_.state == State::estimating || record_.state == State::judging) {
    record_.state = State::estimating;
    return post(Event::recovered);
  }
  lost_at_ = context_.timers.now();
  perform(Action::recover_link);
}

void CalibrationRun::abort(const std::string& reason) {
  if (record_.abort_wanted || suspended_ || is_final(record_.state)) {
    return;
  }
  const Transition* row =
      find_transition(record_.state, Event::abort_requested, [this](Guard guard) { return holds(guard); });
  // Declined without an event: the step under way is not to be broken off.
  if (row == nullptr || row->action == Action::decline_abort) {
    return remember("operator", "too late to abort, the run ends by itself: " + reason);
  }
  record_.abort_wanted = true;
  remember("operator", reason);
  if (record_.reason.empty()) {
    record_.reason = reason;
  }
  // At once, so that it is stored before the operator is told: a daemon that is killed now must not forget it. What the
  // step had to say meanwhile is dropped with the step.
  context_.timers.cancel(event_timer_);
  event_timer_ = 0;
  pending_.reset();
  fire(Event::abort_requested);
}

// What a step raises is taken up by the loop, never from inside the step: firing an event ends it.
void CalibrationRun::post(Event event) {
  pending_ = event;
  context_.timers.cancel(event_timer_);
  event_timer_ = context_.timers.after(0ns, [this] {
    event_timer_ = 0;
    const Event now = *pending_;
    pending_.reset();
    fire(now);
  });
}

void CalibrationRun::fire(Event event) {
  if (suspended_) {
    return;
  }
  const Transition* row = find_transition(record_.state, event, [this](Guard guard) { return holds(guard); });
  if (row == nullptr) {
    return;  // late: the state it belongs to has been left
  }
  const State from = record_.state;
  record_.state = row->next;
  if (is_final(row->next)) {
    close_record();
  }
  if (auto stored = context_.store.update_run(record_); !stored) {
    if (!storage_lost_) {
      return storage_failed(stored.error(), from);
    }
  } else if (row->next != from) {
    remember("state", fmt::format("{}: {}", name(row->next), words(row->next)));
  }
  progress_.state = row->next;
  if (budget_.enter(row->next)) {
    client_.tally().forget();
  }
  if (!is_final(row->next)) {  // else it is told when the INS is out of its session
    context_.observer.on_state(record_);
  }
  perform(row->action);
}

void CalibrationRun::progressed() {
  budget_.progressed();
  client_.tally().forget();
}

void CalibrationRun::budget_spent(double waited_s) {
  const std::string asked = client_.tally().words();
  fail_with(fmt::format("{}: no progress in {:.0f} s while {}{}{}; {}", config_.interface, waited_s,
                        words(record_.state), asked.empty() ? "" : ": ", asked, what_the_ins_holds()));
  pending_.reset();
  context_.timers.cancel(event_timer_);
  event_timer_ = 0;
  fire(Event::step_failed);
}

std::string CalibrationRun::what_the_ins_holds() const {
  if (!new_set_.empty() && in_force_ == new_set_) {
    return "the new set is in force";
  }
  if (budget_.main_path() >= State::resetting) {
    return "the new set is committed, and in force after the next power-on of the INS";
  }
  if (budget_.main_path() == State::committing && commit_asked_) {
    return "the commit was asked for and not confirmed: the old set or the new one is in force after the next power-on";
  }
  return "the old set is in force";
}

// Without a record of it nothing more is begun; the gimbal is stopped if it may turn.
void CalibrationRun::storage_failed(const Error& error, State from) {
  storage_lost_ = true;
  fail_with(error.message);
  record_.state = gimbal_may_turn(from) ? State::stopping : from;
  if (record_.state == State::stopping) {
    budget_.enter(State::stopping);
    return perform(Action::stop_gimbal);
  }
  fire(Event::step_failed);
}

bool CalibrationRun::holds(Guard guard) const {
  const bool ours = record_.rotation != 0 && stock_.run_id == record_.rotation;
  switch (guard) {
    case Guard::always: return true;
    case Guard::rollback: return record_.rollback;
    case Guard::amendment: return record_.amends != 0;
    case Guard::gimbal_turning: return ours && stock_.state == ins::State::rotating;
    case Guard::rotation_complete: return ours && (stock_.state == ins::State::complete || data_complete_);
    case Guard::gate_refused: return !objections_.empty() && record_.force_reason.empty();
    case Guard::dry_run: return record_.dry_run;
    case Guard::drift_check_wanted: return config_.drift_check_s > 0 && !record_.rollback;
    case Guard::new_set_in_force: return !new_set_.empty() && in_force_ == new_set_;
    case Guard::abort_pending: return record_.abort_wanted;
    case Guard::failure_pending: return !record_.abort_wanted;
  }
  return false;
}

void CalibrationRun::perform(Action action) {
  context_.port.cancel();
  switch (action) {
    case Action::none: return;
    case Action::estimate: return estimate();
    case Action::judge: return judge();
    case Action::conclude: return end_session();
    default: break;
  }
  if (action == Action::recover_link && progress_.link_up) {
    progress_.link_up = false;
    lost_at_ = context_.timers.now();
    const std::string text = fmt::format("link lost while {}: {}", words(record_.state), progress_.link_trouble);
    // Before the first answer there is no link to lose: that nobody answers is the run's reason, if it stays so.
    record_.serial.empty() ? remember("link", text) : warn(text);
  }
  task_ = run_step(action);
  task_.start();
}

Task<Done> CalibrationRun::run_step(Action action) {
  const Step outcome = co_await step(action);
  settle(outcome);
  co_return Done{};
}

Task<CalibrationRun::Step> CalibrationRun::step(Action action) {
  switch (action) {
    case Action::identify: return identify();
    case Action::unlock: return unlock();
    case Action::write_schedule: return write_schedule();
    case Action::start_rotation: return start_rotation();
    case Action::follow_rotation: return follow_rotation();
    case Action::end_rotation_early: return end_rotation_early();
    case Action::pull_last_pages: return pull_last_pages();
    case Action::measure_drift_old: return measure_drift(&RunRecord::drift_old_m);
    case Action::measure_drift_new: return measure_drift(&RunRecord::drift_new_m);
    case Action::erase_inactive_slot: return erase_inactive_slot();
    case Action::write_set: return write_set();
    case Action::read_back: return read_back();
    case Action::commit: return commit();
    case Action::reset_ins: return reset_ins();
    case Action::read_in_force: return read_in_force();
    case Action::end_check: return end_check();
    case Action::stop_gimbal: return stop_gimbal();
    default: return recover_link();
  }
}

void CalibrationRun::settle(const Step& step) {
  if (step) {
    return post(*step);
  }
  progress_.link_trouble = step.error().message;
  if (step.error().kind == PortError::Kind::link) {
    return post(Event::link_lost);
  }
  if (step.error().kind == PortError::Kind::local) {
    fail_with(step.error().message);
    return post(Event::step_failed);
  }
  last_nrc_ = step.error().kind == PortError::Kind::negative ? step.error().nrc : -1;
  if (session_lost(last_nrc_)) {
    return post(Event::link_lost);
  }
  fail_with(step.error().message);
  post(Event::step_failed);
}

// An INS that restarted faster than a request times out shows in what it allows no more.
bool CalibrationRun::session_lost(int nrc) {
  constexpr int at_most = 5;  // in one run; more often it is no accident
  const bool unlocked_before = record_.state != State::connecting && record_.state != State::unlocking;
  const bool forgot = nrc == static_cast<int>(uds::Nrc::service_not_supported_in_session) ||
                      nrc == static_cast<int>(uds::Nrc::security_access_denied) ||
                      nrc == static_cast<int>(uds::Nrc::request_sequence_error);  // of a transfer it knows nothing of
  return unlocked_before && forgot && ++sessions_lost_ <= at_most;
}

// The first reason is the one that counts: what follows is its consequence.
void CalibrationRun::fail_with(const std::string& reason, ErrorKind kind) {
  if (!failed_) {
    failed_ = true;
    failure_status_ = static_cast<int>(kind);
    record_.reason = reason;
  }
  remember("error", reason);
}

// Whatever the end: the INS is left locked, in its default session, and nobody keeps another one alive.
void CalibrationRun::end_session() {
  task_ = {};
  context_.estimators.cancel();
  if (!client_.session_asked_for()) {
    return conclude();
  }
  session_end_.begin([this](const std::string& trouble) {
    if (!trouble.empty()) {
      remember("session", fmt::format("the INS did not confirm its default session ({}): it goes back to it by itself, "
                                      "5 s after the last TesterPresent (S3)",
                                      trouble));
    }
    conclude();
  });
}

void CalibrationRun::suspend(std::function<void()> done) {
  if (session_end_.under_way()) {
    after_end_ = std::move(done);
    return;
  }
  suspended_ = true;
  task_ = {};
  context_.timers.cancel(event_timer_);
  event_timer_ = 0;
  context_.estimators.cancel();
  remember("daemon",
           fmt::format("the daemon stops while {}; the run goes on when it starts again", words(record_.state)));
  if (!client_.session_asked_for()) {
    return done();
  }
  session_end_.begin([done = std::move(done)](const std::string&) { done(); });
}

void CalibrationRun::report_end_at_once() {
  if (is_final(record_.state) && !over_) {
    session_end_.abandon();
    conclude();
  }
}

void CalibrationRun::conclude() {
  over_ = true;
  running_.end();
  sum_up_bus_events();
  // Of no use any more: the recording is kept, or the run will not be resumed.
  pages_.reset();
  drop_pages(folder_);
  const bool well = record_.state == State::completed;
  journal::Fields fields = journal_fields(record_);
  fields.nrc = last_nrc_;
  progress_.summary = run_summary(context_.store, record_);
  journal::write(well ? journal::Level::notice : journal::Level::error,
                 fmt::format("{}{}{}", progress_.summary.verdict, progress_.summary.cause.empty() ? "" : " ",
                             progress_.summary.cause),
                 fields);
  report_progress(true);
  context_.observer.on_state(record_);
  context_.observer.on_finished(record_);
  if (after_end_) {
    std::exchange(after_end_, {})();
  }
}

void CalibrationRun::remember(const std::string& kind, const std::string& text) {
  journal::write(kind == "error" ? journal::Level::error : journal::Level::info, text, journal_fields(record_));
  if (storage_lost_) {
    return;
  }
  if (auto stored = context_.store.add_event(record_.id, {utc_now(), kind, text}); !stored) {
    journal::write(journal::Level::error, stored.error().message, journal_fields(record_));
  }
}

void CalibrationRun::warn(const std::string& text) {
  remember("warning", text);
  context_.observer.on_warning(record_, text);
}

void CalibrationRun::report_progress(bool at_once) {
  const SteadyTime now = context_.timers.now();
  if (!at_once && now - reported_at_ < report_interval) {
    return;
  }
  reported_at_ = now;
  progress_.lost_frames = context_.port.lost_frames();
  context_.observer.on_progress(record_);
}

void CalibrationRun::on_status(const ins::Status& status) {
  status_at_ = context_.timers.now();
  progress_.ins = status;
  foresee_finish();
  report_progress();
}

void CalibrationRun::on_bus_event(can::BusEvent event) {
  if (is_final(record_.state)) {
    return;
  }
  BusEventCount& seen = bus_events_[event];
  const SteadyTime now = context_.timers.now();
  const bool first = ++seen.count == 1;
  if (!first && now - seen.said_at < bus_event_interval) {
    return;
  }
  seen.said_at = now;
  std::string text = fmt::format("{}: {}", config_.interface, can::name(event));
  if (!first) {
    text += fmt::format(", {} times in this run", seen.count);
  }
  alarming(event) ? warn(text) : remember("bus", text);
}

void CalibrationRun::sum_up_bus_events() {
  std::string text;
  for (const auto& [event, seen] : bus_events_) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", seen.count, can::name(event));
  }
  if (!text.empty()) {
    remember("bus", fmt::format("{}: error frames in this run: {}", config_.interface, text));
  }
}

tl::unexpected<PortError> CalibrationRun::senseless(const std::string& message) const {
  return tl::unexpected<PortError>(
      PortError{PortError::Kind::protocol, 0, fmt::format("{}: {}", config_.interface, message)});
}

tl::unexpected<PortError> CalibrationRun::local_trouble(const Error& error) const {
  return tl::unexpected<PortError>(PortError{PortError::Kind::local, 0, error.message});
}

std::chrono::nanoseconds CalibrationRun::ins_time(double seconds) const {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(seconds / config_.time_scale * 1e9));
}

}  // namespace selfcal
