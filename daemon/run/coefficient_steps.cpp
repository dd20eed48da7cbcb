// What the actions of the table do from the estimate to the proof that the INS uses the new set.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <limits>

#include "daemon/estimate/amendment_job.hpp"
#include "daemon/estimate/coefficient_set.hpp"
#include "daemon/estimate/estimate_job.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/run/calibration_run.hpp"
#include "daemon/run/ins_checks.hpp"
#include "daemon/store/parameter_trend.hpp"
#include "protocol/byte_order.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr double reset_limit_s = 60.0;       // of the INS's clock
constexpr auto reset_patience = 5s;          // of ours, beyond that
constexpr double drift_margin_s = 60.0;      // beyond the length of the drift check, of the INS's clock
constexpr double check_stop_limit_s = 30.0;  // of the INS's clock, after it agreed to stop its check

// A routine that cannot be stopped ends by itself; any other refusal is a failure, or a lost session.
bool cannot_be_stopped(const PortError& error) {
  return error.kind == PortError::Kind::negative &&
         (error.nrc == static_cast<std::uint8_t>(uds::Nrc::sub_function_not_supported) ||
          error.nrc == static_cast<std::uint8_t>(uds::Nrc::request_out_of_range) ||
          error.nrc == static_cast<std::uint8_t>(uds::Nrc::conditions_not_correct));
}

int exit_status(State state, int failure) {
  switch (state) {
    case State::completed: return 0;
    case State::refused:
    case State::aborted: return 1;
    default: return failure;
  }
}

}  // namespace

void CalibrationRun::estimate() {
  task_ = {};
  running_.drop_current();
  context_.estimators.start(
      record_.amends == 0
          ? estimate_job({folder_, record_.rotation, record_.serial, record_.started_utc, schedule_, config_})
          : amendment_job({record_.amends, amended_recording(), folder_, config_}),
      [this](const CalibrationProgress& progress) { on_estimate_progress(progress); },
      [this](Expected<Estimate> answer) { on_estimate(std::move(answer)); });
}

// Empty where the store cannot say: the job's error names the file then.
std::filesystem::path CalibrationRun::amended_recording() const {
  const auto amended = context_.store.run(record_.amends);
  return amended && *amended ? std::filesystem::path((*amended)->recording) : std::filesystem::path();
}

void CalibrationRun::on_estimate_progress(const CalibrationProgress& progress) {
  progressed();
  progress_.pass = progress.pass;
  progress_.pass_fraction = progress.fraction;
  progress_.running = false;
  if (record_.amends == 0) {
    show_estimate(progress.value, progress.sigma);
  }
  report_progress();
}

void CalibrationRun::on_estimate(Expected<Estimate> answer) {
  if (!answer) {
    fail_with(answer.error().message, answer.error().kind);
    return post(Event::step_failed);
  }
  estimate_ = std::move(*answer);
  for (const std::string& warning : estimate_->warnings) {
    warn(warning);
  }
  for (const std::string& note : estimate_->notes) {
    remember("amendment", note);
  }
  post(Event::estimate_ready);
}

void CalibrationRun::judge() {
  task_ = {};
  objections_ = estimate_->objections;
  if (auto stored = store_result(); !stored) {
    fail_with(stored.error().message, stored.error().kind);
    return post(Event::step_failed);
  }
  for (const std::string& objection : objections_) {
    remember("gate", objection);
  }
  if (!objections_.empty() && !record_.force_reason.empty()) {
    warn(fmt::format("written against the gate ({}), for: {}", fmt::join(objections_, "; "), record_.force_reason));
  }
  post(Event::judged);
}

Expected<void> CalibrationRun::store_result() {
  RunStore::Parameters parameters;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    parameters.value[i] = estimate_->result.value(index) / sensor_parameters[i].si_per_unit;
    parameters.sigma[i] = estimate_->result.sigma(index) / sensor_parameters[i].si_per_unit;
    parameters.determined[i] = estimate_->result.determined[i];
  }
  show_estimate(estimate_->result.value, estimate_->result.sigma);
  warn_of_history(parameters);
  record_.recording = estimate_->recording;
  record_.result_json = estimate_->result_json;
  if (auto stored = context_.store.store_parameters(record_.id, parameters); !stored) {
    return stored;
  }
  return make_new_set();
}

// A value that is undetermined or physically impossible is never pushed, whatever the operator's reason: the one in
// force stays, and the story says so.
Expected<void> CalibrationRun::make_new_set() {
  const auto previous = context_.store.set(record_.id, SetRole::previous);
  if (!previous) {
    return tl::unexpected(previous.error());
  }
  if (!*previous) {
    return fail(ErrorKind::internal, fmt::format("run {}: the set in force was not kept", record_.id));
  }
  const auto in_force = ins::decode_coefficients(**previous);
  if (!in_force) {
    return tl::unexpected(in_force.error());
  }
  const CoefficientSet measured = coefficient_set(estimate_->result, objections_.empty(), record_.serial, utc_now());
  std::vector<std::string_view> kept;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    if (!measured.determined[i]) {
      kept.push_back(sensor_parameters[i].name);
    }
  }
  if (!kept.empty()) {
    remember("gate", fmt::format("never written, the value in force stays: {}", fmt::join(kept, ", ")));
  }
  ins::Coefficients fresh;
  fresh.version = in_force->version + 1;
  fresh.date_s = std::time(nullptr);
  fresh.author = fmt::format("selfcal run {} {}", record_.id, record_.user).substr(0, ins::author_bytes);
  fresh.value = merged_with_in_force(measured, in_force->value);
  if (const Complaint complaint =
          check_coefficients(fresh.value, "the set to be written, where the one in force stays")) {
    if (!record_.dry_run && (objections_.empty() || !record_.force_reason.empty())) {
      return fail(ErrorKind::device, fmt::format("{}: {}", config_.interface, *complaint));
    }
    remember("gate", *complaint);
  }
  const auto bytes = ins::encode(fresh);
  new_set_.assign(bytes.begin(), bytes.end());
  return context_.store.store_set(record_.id, SetRole::written, new_set_);
}

void CalibrationRun::warn_of_history(const RunStore::Parameters& parameters) {
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const auto past = context_.store.parameter_history(record_.serial, static_cast<int>(i));
    if (!past) {
      return;
    }
    const ParameterRecord now{record_.id, utc_now(), parameters.value[i], parameters.sigma[i],
                              parameters.determined[i]};
    const SensorParameter& parameter = sensor_parameters[i];
    for (const std::string& text : trend_warnings(std::string(parameter.name), std::string(parameter.unit), *past, now,
                                                  config_.limit[i].value_or(0.0))) {
      warn(text);
    }
  }
}

Task<CalibrationRun::Step> CalibrationRun::measure_drift(double RunRecord::*figure) {
  ins::NavigationCheckRequest request;
  request.duration_s = static_cast<std::uint32_t>(config_.drift_check_s);
  request.compensation = ins::Slot::a;  // that is: what is in force
  const auto before = co_await client_.read_state();
  if (!before) {
    co_return tl::unexpected(before.error());
  }
  if (before->power_cycles != power_cycles_.value_or(before->power_cycles)) {
    co_return tl::unexpected<PortError>(
        PortError{PortError::Kind::link, 0, config_.interface + ": the INS restarted before its navigation check"});
  }
  power_cycles_ = before->power_cycles;
  // A daemon that was restarted meanwhile finds its own check going on; the INS would refuse another one.
  if (before->state != ins::State::checking) {
    const auto begun =
        co_await client_.routine(uds::RoutineAction::start, ins::routine::navigation_check, ins::encode(request));
    if (!begun) {
      co_return tl::unexpected(begun.error());
    }
  }
  const SteadyTime end = context_.timers.now() + ins_time(config_.drift_check_s + drift_margin_s) + 5s;
  while (true) {
    const auto state = co_await client_.read_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    if (state->power_cycles != *power_cycles_) {  // the same as a link that was away
      co_return tl::unexpected<PortError>(PortError{
          PortError::Kind::link, 0, config_.interface + ": the INS restarted in the middle of its navigation check"});
    }
    const auto answer = co_await client_.routine(uds::RoutineAction::result, ins::routine::navigation_check, {});
    if (!answer) {
      co_return tl::unexpected(answer.error());
    }
    const auto drift = ins::decode_navigation_result(*answer);
    if (!drift) {
      co_return senseless(drift.error().message);
    }
    if (const Complaint complaint = check_navigation(*drift, request.duration_s)) {
      co_return senseless(*complaint);
    }
    if (drift->done) {
      record_.*figure = drift->max_horizontal_m;
      remember("drift",
               fmt::format("free-inertial drift over {:.0f} s: {:.1f} m", drift->elapsed_s, drift->max_horizontal_m));
      break;
    }
    if (context_.timers.now() > end) {
      co_return senseless("the navigation check does not end");
    }
    co_await Sleep(context_.timers, ins_time(2.0));
  }
  if (figure == &RunRecord::drift_new_m && record_.drift_old_m >= 0 && record_.drift_new_m > record_.drift_old_m) {
    warn(fmt::format("the INS drifts more with the new set than with the old: {:.1f} m against {:.1f} m",
                     record_.drift_new_m, record_.drift_old_m));
  }
  co_return Event::drift_measured;
}

Task<Answer<Done>> CalibrationRun::stop_check() {
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  if (state->state != ins::State::checking) {
    co_return Done{};
  }
  double limit_s = check_stop_limit_s;
  const auto stopped = co_await client_.routine(uds::RoutineAction::stop, ins::routine::navigation_check, {});
  if (!stopped) {
    if (!cannot_be_stopped(stopped.error())) {
      co_return tl::unexpected(stopped.error());
    }
    limit_s = config_.drift_check_s + drift_margin_s;
    budget_.extend(ins_time(limit_s));
    warn(fmt::format("{}: the end of the navigation check is waited for, {:.0f} s of the INS's clock at most",
                     stopped.error().message, limit_s));
  }
  if (auto ended = co_await await_state(ins::State::checking, limit_s, "the navigation check goes on"); !ended) {
    co_return tl::unexpected(ended.error());
  }
  remember("ins", stopped ? "navigation check stopped" : "navigation check over");
  co_return Done{};
}

Task<CalibrationRun::Step> CalibrationRun::end_check() {
  if (auto ended = co_await stop_check(); !ended) {
    co_return tl::unexpected(ended.error());
  }
  co_return Event::check_ended;
}

Task<CalibrationRun::Step> CalibrationRun::erase_inactive_slot() {
  const auto kept = context_.store.set(record_.id, SetRole::written);
  if (!kept) {
    co_return local_trouble(kept.error());
  }
  auto wanted = *kept ? ins::decode_coefficients(**kept)
                      : Expected<ins::Coefficients>(fail(ErrorKind::internal, "the set to be written was not kept"));
  if (!wanted) {
    co_return local_trouble(wanted.error());
  }
  if (auto same = co_await confirm_identity("the inactive slot is erased"); !same) {
    co_return tl::unexpected(same.error());
  }
  if (auto taken = co_await take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (const Complaint complaint = check_coefficients(wanted->value, "the set to be written")) {
    co_return senseless(*complaint);
  }
  // The INS takes the newest: a set that is put back needs a version above the one in force.
  if (stock_.coefficients_version == std::numeric_limits<std::uint32_t>::max()) {
    co_return senseless(fmt::format("coefficients version {} is in force: none is newer", stock_.coefficients_version));
  }
  if (wanted->version <= stock_.coefficients_version) {
    wanted->version = stock_.coefficients_version + 1;
  }
  const auto bytes = ins::encode(*wanted);
  new_set_.assign(bytes.begin(), bytes.end());
  if (auto stored = context_.store.store_set(record_.id, SetRole::written, new_set_); !stored) {
    co_return local_trouble(stored.error());
  }
  const auto erased = co_await client_.routine(uds::RoutineAction::start, ins::routine::erase_inactive, {});
  if (!erased) {
    co_return tl::unexpected(erased.error());
  }
  if (auto empty = co_await check_erased(); !empty) {
    co_return tl::unexpected(empty.error());
  }
  co_return Event::slot_erased;
}

// An erased slot reads as nothing (conditionsNotCorrect, requestOutOfRange) or as erased FLASH.
Task<Answer<Done>> CalibrationRun::check_erased() {
  const auto slot = co_await client_.read_record(ins::did::coefficients_inactive);
  if (!slot) {
    const bool nothing = slot.error().kind == PortError::Kind::negative &&
                         (slot.error().nrc == static_cast<std::uint8_t>(uds::Nrc::conditions_not_correct) ||
                          slot.error().nrc == static_cast<std::uint8_t>(uds::Nrc::request_out_of_range));
    if (!nothing) {
      co_return tl::unexpected(slot.error());
    }
    co_return Done{};
  }
  if (!std::all_of(slot->begin(), slot->end(), [](std::uint8_t byte) { return byte == 0xFF; })) {
    const auto set = ins::decode_coefficients(*slot);
    co_return senseless(fmt::format(
        "the inactive slot was to be erased and still holds {}; {}",
        set ? fmt::format("version {}", set->version) : fmt::format("{} bytes", slot->size()), what_the_ins_holds()));
  }
  co_return Done{};
}

Task<CalibrationRun::Step> CalibrationRun::write_set() {
  if (auto same = co_await confirm_identity("the set is written"); !same) {
    co_return tl::unexpected(same.error());
  }
  const auto written = co_await client_.write_record(ins::did::coefficients_inactive, new_set_);
  if (!written) {
    co_return tl::unexpected(written.error());
  }
  co_return Event::set_written;
}

Task<CalibrationRun::Step> CalibrationRun::read_back() {
  const auto slot = co_await client_.read_record(ins::did::coefficients_inactive);
  if (!slot) {
    co_return tl::unexpected(slot.error());
  }
  if (slot->empty()) {
    co_return senseless("the coefficients read back are an empty record");
  }
  if (auto stored = context_.store.store_set(record_.id, SetRole::read_back, *slot); !stored) {
    co_return local_trouble(stored.error());
  }
  if (*slot != new_set_) {
    co_return senseless("the coefficients read back are not those written");
  }
  co_return Event::set_verified;
}

Task<CalibrationRun::Step> CalibrationRun::commit() {
  if (auto same = co_await confirm_identity("the set is committed"); !same) {
    co_return tl::unexpected(same.error());
  }
  ins::CoefficientsBytes bytes;
  std::copy(new_set_.begin(), new_set_.end(), bytes.begin());
  Bytes crc(4);
  ByteWriter(crc).put(ins::stored_crc(bytes));
  commit_asked_ = true;
  const auto done =
      co_await client_.routine(uds::RoutineAction::start, ins::routine::commit_coefficients, std::move(crc));
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  co_return Event::set_committed;
}

// The INS is away for a while; that it does not answer then is no lost link.
Task<CalibrationRun::Step> CalibrationRun::reset_ins() {
  const auto before = co_await client_.read_state();
  if (!before) {
    co_return tl::unexpected(before.error());
  }
  if (auto asked = co_await client_.reset(); !asked) {
    co_return tl::unexpected(asked.error());
  }
  std::uint32_t after = 0;
  const SteadyTime end = context_.timers.now() + ins_time(reset_limit_s) + reset_patience;
  while (true) {
    co_await Sleep(context_.timers, 20ms);
    const auto state = co_await client_.read_state();
    const bool up = state && state->state != ins::State::starting && state->power_cycles != before->power_cycles;
    if (up) {
      after = state->power_cycles;
      break;
    }
    if (context_.timers.now() < end) {
      continue;
    }
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    co_return senseless(fmt::format("the INS did not restart within {} s", reset_limit_s));
  }
  if (auto known = co_await check_serial(); !known) {
    co_return tl::unexpected(known.error());
  }
  if (auto unlocked = co_await client_.unlock(key_); !unlocked) {
    co_return tl::unexpected(unlocked.error());
  }
  const std::uint32_t restarts = after - before->power_cycles;
  if (after < before->power_cycles) {
    co_return senseless(fmt::format("the power-cycle counter went back from {} to {} upon a reset; {}",
                                    before->power_cycles, after, what_the_ins_holds()));
  }
  if (restarts > 1) {
    warn(fmt::format("{}: one reset counted as {} power cycles, {} to {}", config_.interface, restarts,
                     before->power_cycles, after));
  }
  power_cycles_ = after;
  co_return Event::ins_restarted;
}

Task<CalibrationRun::Step> CalibrationRun::read_in_force() {
  if (auto taken = co_await take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (in_force_ != new_set_) {
    co_return senseless(fmt::format("after the power cycle the INS uses version {} (CRC {:08X}), not the set written",
                                    stock_.coefficients_version, stock_.coefficients_crc));
  }
  remember("ins", fmt::format("coefficients version {} in force after the power cycle", stock_.coefficients_version));
  co_return Event::set_confirmed;
}

// All that is to be known of a run that ends now, so that its last state is stored together with it.
void CalibrationRun::close_record() {
  record_.ended_utc = utc_now();
  record_.exit_status = exit_status(record_.state, failure_status_);
  std::error_code ignored;
  if (record_.recording.empty() && std::filesystem::exists(recording_path(folder_), ignored)) {
    record_.recording = recording_path(folder_).string();
  }
  if (record_.state == State::completed && !record_.abort_wanted) {
    record_.reason.clear();
  } else if (!record_.serial.empty()) {
    remember("ins", what_the_ins_holds());
  }
  if (record_.state == State::refused) {
    record_.reason = fmt::format("not written: {}", objections_.front());
    if (objections_.size() > 1) {
      record_.reason += fmt::format("; and {} more objections", objections_.size() - 1);
    }
  }
}

}  // namespace selfcal
