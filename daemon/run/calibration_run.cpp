#include "daemon/run/calibration_run.hpp"

#include <fmt/format.h>

#include <utility>

#include "daemon/estimate/estimate_job.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/store/page_recording.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

int exit_status(State state, int failure) {
  switch (state) {
    case State::completed: return 0;
    case State::refused:
    case State::aborted: return 1;
    default: return failure;
  }
}

}  // namespace

CalibrationRun::CalibrationRun(RunContext context, InsConfig config, Schedule schedule, UnlockKey key, RunRecord record,
                               std::filesystem::path folder)
    : context_(context),
      journal_(context.timers, context.store, context.port, context.observer, std::move(record)),
      data_(std::move(config), std::move(schedule), key, std::move(folder)),
      client_(context.timers, context.port, data_.config.profile),
      session_end_(context.timers, context.port),
      budget_(context.timers, data_.config, [this](double waited_s) { budget_spent(waited_s); }),
      raw_(step_context()),
      running_(step_context(), context.estimators, raw_),
      rotation_(step_context(), raw_, running_),
      navigation_(step_context()),
      connection_(step_context(), navigation_),
      estimate_(step_context(), context.estimators, running_, [this](Event event) { post(event); }),
      coefficients_(step_context(), connection_) {
  RunProgress& progress = journal_.progress;
  progress.positions = static_cast<int>(data_.schedule.positions.size());
  const ParameterVector tolerance = calibration_options(data_.config).tolerance;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    progress.tolerance[i] = tolerance(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
  }
  context_.port.on_status = [this](const ins::Status& status) { on_status(status); };
  context_.port.on_bus_event = [this](can::BusEvent event) { journal_.on_bus_event(event); };
}

StepContext CalibrationRun::step_context() {
  return {context_.timers, context_.port, context_.store, client_, budget_, journal_, data_};
}

CalibrationRun::~CalibrationRun() {
  context_.port.on_status = {};
  context_.port.on_bus_event = {};
  context_.port.keep_session(false);
  context_.timers.cancel(event_timer_);
  context_.estimators.cancel();
}

void CalibrationRun::begin() {
  budget_.begin(journal_.record.state);
  post(Event::begin);
}

void CalibrationRun::resume() {
  data_.commit_asked = journal_.record.state == State::committing;  // perhaps, by the daemon that is gone
  budget_.begin(journal_.record.state);
  journal_.remember("resume", fmt::format("the daemon was restarted while {}", words(journal_.record.state)));
  if (const auto kept = context_.store.set(journal_.record.id, SetRole::written); kept && *kept) {
    data_.new_set = **kept;
  }
  // Estimating and judging need no INS, only the pages on disk.
  if (journal_.record.state == State::estimating || journal_.record.state == State::judging) {
    journal_.record.state = State::estimating;
    return post(Event::recovered);
  }
  lost_at_ = context_.timers.now();
  perform(Action::recover_link);
}

void CalibrationRun::abort(const std::string& reason) {
  if (journal_.record.abort_wanted || suspended_ || is_final(journal_.record.state)) {
    return;
  }
  const Transition* row = row_for(Event::abort_requested);
  // Declined without an event: the step under way is not to be broken off.
  if (row == nullptr || row->action == Action::decline_abort) {
    return journal_.remember("operator", "too late to abort, the run ends by itself: " + reason);
  }
  journal_.record.abort_wanted = true;
  journal_.remember("operator", reason);
  if (journal_.record.reason.empty()) {
    journal_.record.reason = reason;
  }
  // At once, so that it is stored before the operator is told: a daemon that is killed now must not forget it. What the
  // step had to say meanwhile is dropped with the step.
  drop_posted();
  fire(Event::abort_requested);
}

const Transition* CalibrationRun::row_for(Event event) const {
  return find_transition(journal_.record.state, event, [this](Guard guard) { return holds(guard); });
}

void CalibrationRun::drop_posted() {
  context_.timers.cancel(event_timer_);
  event_timer_ = 0;
  pending_.reset();
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
  const Transition* row = row_for(event);
  if (row == nullptr) {
    return;  // late: the state it belongs to has been left
  }
  const State from = journal_.record.state;
  journal_.record.state = row->next;
  if (is_final(row->next)) {
    close_record();
  }
  if (auto stored = journal_.store_record(); !stored) {
    return storage_failed(stored.error(), from);
  }
  if (row->next != from && !journal_.storage_lost()) {
    journal_.remember("state", fmt::format("{}: {}", name(row->next), words(row->next)));
  }
  journal_.progress.state = row->next;
  if (budget_.enter(row->next)) {
    client_.tally().forget();
  }
  if (!is_final(row->next)) {  // else it is reported when the INS is out of its session
    journal_.report_state();
  }
  perform(row->action);
}

void CalibrationRun::budget_spent(double waited_s) {
  const std::string asked = client_.tally().words();
  journal_.fail_with(fmt::format("{}: no progress in {:.0f} s while {}{}{}; {}", data_.config.interface, waited_s,
                                 words(journal_.record.state), asked.empty() ? "" : ": ", asked,
                                 what_the_ins_holds(data_, budget_.main_path())));
  drop_posted();
  fire(Event::step_failed);
}

// Without a record of it nothing more is begun; the gimbal is stopped if it may turn.
void CalibrationRun::storage_failed(const Error& error, State from) {
  journal_.fail_with(error.message);
  journal_.record.state = gimbal_may_turn(from) ? State::stopping : from;
  if (journal_.record.state == State::stopping) {
    budget_.enter(State::stopping);
    return perform(Action::stop_gimbal);
  }
  fire(Event::step_failed);
}

bool CalibrationRun::holds(Guard guard) const {
  const bool ours = journal_.record.rotation != 0 && data_.state.run_id == journal_.record.rotation;
  switch (guard) {
    case Guard::always: return true;
    case Guard::rollback: return journal_.record.rollback;
    case Guard::amendment: return journal_.record.amends != 0;
    case Guard::gimbal_turning: return ours && data_.state.state == ins::State::rotating;
    case Guard::rotation_complete: return ours && (data_.state.state == ins::State::complete || data_.data_complete);
    case Guard::gate_refused: return !data_.objections.empty() && journal_.record.force_reason.empty();
    case Guard::dry_run: return journal_.record.dry_run;
    case Guard::drift_check_wanted: return data_.config.drift_check_s > 0 && !journal_.record.rollback;
    case Guard::new_set_in_force: return data_.new_set_in_force();
    case Guard::abort_pending: return journal_.record.abort_wanted;
    case Guard::failure_pending: return !journal_.record.abort_wanted;
    case Guard::no_slots: return !data_.config.profile->slots;
  }
  return false;
}

void CalibrationRun::perform(Action action) {
  context_.port.cancel();
  switch (action) {
    case Action::none: return;
    case Action::estimate: task_ = {}; return estimate_.estimate();
    case Action::judge: task_ = {}; return estimate_.judge();
    case Action::conclude: return end_session();
    default: break;
  }
  if (action == Action::recover_link && journal_.progress.link_up) {
    journal_.progress.link_up = false;
    lost_at_ = context_.timers.now();
    const std::string text =
        fmt::format("link lost while {}: {}", words(journal_.record.state), journal_.progress.link_trouble);
    // Before the first answer there is no link to lose: that nobody answers is the run's reason, if it stays so.
    journal_.record.serial.empty() ? journal_.remember("link", text) : journal_.warn(text);
  }
  task_ = run_step(action);
  task_.start();
}

Task<Done> CalibrationRun::run_step(Action action) {
  const Step outcome = co_await step(action);
  settle(outcome);
  co_return Done{};
}

Task<Step> CalibrationRun::step(Action action) {
  switch (action) {
    case Action::identify: return connection_.identify();
    case Action::unlock: return connection_.unlock();
    case Action::write_schedule: return rotation_.write_schedule();
    case Action::start_rotation: return rotation_.start_rotation();
    case Action::follow_rotation: return rotation_.follow_rotation();
    case Action::end_rotation_early: return rotation_.end_rotation_early();
    case Action::pull_last_pages: return rotation_.pull_last_pages();
    case Action::measure_drift_old: return navigation_.measure_drift(&RunRecord::drift_old_m);
    case Action::measure_drift_new: return navigation_.measure_drift(&RunRecord::drift_new_m);
    case Action::erase_inactive_slot: return coefficients_.erase_inactive_slot();
    case Action::write_set: return coefficients_.write_set();
    case Action::read_back: return coefficients_.read_back();
    case Action::commit: return coefficients_.commit();
    case Action::reset_ins: return coefficients_.reset_ins();
    case Action::read_in_force: return coefficients_.read_in_force();
    case Action::end_check: return navigation_.end_check();
    case Action::stop_gimbal: return rotation_.stop_gimbal();
    case Action::put_back: return coefficients_.put_back();
    default: return connection_.recover_link(lost_at_);
  }
}

void CalibrationRun::settle(const Step& step) {
  if (step) {
    return post(*step);
  }
  journal_.progress.link_trouble = step.error().message;
  if (step.error().kind == PortError::Kind::link) {
    return post(Event::link_lost);
  }
  if (step.error().kind == PortError::Kind::local) {
    journal_.fail_with(step.error().message);
    return post(Event::step_failed);
  }
  journal_.last_nrc = step.error().kind == PortError::Kind::negative ? step.error().nrc : -1;
  if (session_lost(journal_.last_nrc)) {
    return post(Event::link_lost);
  }
  journal_.fail_with(step.error().message);
  post(Event::step_failed);
}

// An INS that restarted faster than a request times out shows in what it allows no more.
bool CalibrationRun::session_lost(int nrc) {
  constexpr int at_most = 5;  // in one run; more often it is no accident
  const bool unlocked_before = journal_.record.state != State::connecting && journal_.record.state != State::unlocking;
  const bool forgot = nrc == static_cast<int>(uds::Nrc::service_not_supported_in_session) ||
                      nrc == static_cast<int>(uds::Nrc::security_access_denied) ||
                      nrc == static_cast<int>(uds::Nrc::request_sequence_error);  // of a transfer it knows nothing of
  return unlocked_before && forgot && ++sessions_lost_ <= at_most;
}

// All that is to be known of a run that ends now, so that its last state is stored together with it.
void CalibrationRun::close_record() {
  journal_.record.ended_utc = utc_now();
  journal_.record.exit_status = exit_status(journal_.record.state, journal_.failure_status());
  std::error_code ignored;
  if (journal_.record.recording.empty() && std::filesystem::exists(recording_path(data_.folder), ignored)) {
    journal_.record.recording = recording_path(data_.folder).string();
  }
  if (journal_.record.state == State::completed && !journal_.record.abort_wanted) {
    journal_.record.reason.clear();
  } else if (!journal_.record.serial.empty()) {
    journal_.remember("ins", what_the_ins_holds(data_, budget_.main_path()));
  }
  if (journal_.record.state == State::refused) {
    journal_.record.reason = fmt::format("not written: {}", data_.objections.front());
    if (data_.objections.size() > 1) {
      journal_.record.reason += fmt::format("; and {} more objections", data_.objections.size() - 1);
    }
  }
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
      journal_.remember("session",
                        fmt::format("the INS did not confirm its default session ({}): it goes back to it by itself, "
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
  drop_posted();
  context_.estimators.cancel();
  journal_.remember("daemon", fmt::format("the daemon stops while {}; the run goes on when it starts again",
                                          words(journal_.record.state)));
  if (!client_.session_asked_for()) {
    return done();
  }
  session_end_.begin([done = std::move(done)](const std::string&) { done(); });
}

void CalibrationRun::report_end_at_once() {
  if (is_final(journal_.record.state) && !over_) {
    session_end_.abandon();
    conclude();
  }
}

void CalibrationRun::conclude() {
  over_ = true;
  running_.end();
  // Of no use any more: the recording is kept, or the run will not be resumed.
  raw_.close();
  drop_pages(data_.folder);
  journal_.conclude();
  if (after_end_) {
    std::exchange(after_end_, {})();
  }
}

void CalibrationRun::on_status(const ins::Status& status) {
  data_.status_at = context_.timers.now();
  journal_.progress.ins = status;
  running_.foresee_finish();
  journal_.report_progress();
}

}  // namespace selfcal
