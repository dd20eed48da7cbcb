#include "daemon/ins/move_port.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/profile/records.hpp"
#include "protocol/profile/told_as.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using uds::Nrc;
using uds::RoutineAction;

constexpr std::size_t longest_answer_to_own = 512;
// While a move is waited for: tenths of a second of the INS's clock, where the bus can do that.
constexpr double look_interval_s = 0.1;
constexpr auto shortest_look_interval = 10ms;
constexpr auto retry_interval = 300ms;
// busyRepeatRequest: ISO 14229-1 has the client repeat the request.
constexpr int busy_repeats = 10;
constexpr auto busy_pause = 100ms;
constexpr double radians_per_degree = 3.14159265358979323846 / 180.0;

bool is(const PortError& error, std::initializer_list<Nrc> codes) {
  return error.kind == PortError::Kind::negative &&
         std::ranges::any_of(codes, [&](Nrc code) { return error.nrc == static_cast<std::uint8_t>(code); });
}

ins::MoveRecord record_of(const ins::ScheduleRecord::Position& position) {
  return {position.outer_mdeg, position.inner_mdeg};
}

}  // namespace

MovePort::MovePort(Timers& timers, std::shared_ptr<InsPort> ins, const InsConfig& config)
    : timers_(timers), ins_(std::move(ins)), config_(config), told_(profile::told_as(config.profile)) {
  ins_->on_bus_event = [this](can::BusEvent event) {
    if (on_bus_event) {
      on_bus_event(event);
    }
  };
  ins_->on_status = [this](const ins::Status& told) {
    ins::Status status = told;
    status.state = as_rotation(told.state);
    status.position = static_cast<std::uint8_t>(turning() ? sequence_.position() : 0);
    status.time_left_s = sequence_.left_s(now_s());
    status.moving = told.moving || waits();
    if (on_status) {
      on_status(status);
    }
  };
}

MovePort::~MovePort() {
  for (const Timers::Id timer : {answer_timer_, watch_timer_, again_timer_}) {
    timers_.cancel(timer);
  }
  if (own_ != Own::nothing || passed_on_) {
    ins_->cancel();
  }
  ins_->on_bus_event = {};
  ins_->on_status = {};
}

double MovePort::now_s() const { return std::chrono::duration<double>(timers_.now()).count() * config_.time_scale; }

// --- the service's requests

void MovePort::request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
                       std::function<void(Answer<Bytes>)> done) {
  done_ = std::move(done);
  request_.assign(payload.begin(), payload.end());
  longest_answer_ = longest_answer;
  if (keeps(payload)) {
    return;
  }
  pending_ = true;
  next();
}

// What is answered here; and what is known from what goes through.
bool MovePort::keeps(std::span<const std::uint8_t> payload) {
  if (payload[0] == uds::service::session_control) {
    session_open_ = payload[1] == config_.profile->session;
    if (!session_open_) {  // nobody follows the rotation any more
      sequence_.stop();
      wanted_ = Own::nothing;
    }
  }
  const auto number = static_cast<std::uint16_t>(payload.size() >= 3 ? payload[1] << 8U | payload[2] : 0);
  if (payload[0] == uds::service::write_data && number == profile::kept_schedule_did) {
    keep_schedule(payload.subspan(3));
    return true;
  }
  const auto call =
      payload[0] == uds::service::routine_control ? uds::parse_routine_request(payload) : tl::unexpected(Nrc::none);
  if (!call || call->routine != config_.profile->rotate.id) {
    return false;
  }
  if (call->action == RoutineAction::start) {
    begin_rotation();
    return true;
  }
  if (call->action == RoutineAction::stop) {
    stopped_ = stopped_ || turning();
    sequence_.stop();
    wanted_ = Own::nothing;
  }
  return false;
}

// Angles that the record of a move cannot hold are told before anything turns.
void MovePort::keep_schedule(std::span<const std::uint8_t> record) {
  auto schedule = profile::decode_schedule(*told_, record);
  if (!schedule) {
    return answer_later(tl::unexpected(trouble(schedule.error().message)));
  }
  for (std::size_t k = 0; k < schedule->positions.size(); ++k) {
    const auto& position = schedule->positions[k];
    if (const auto fits = profile::encode(*config_.profile, record_of(position)); !fits) {
      return answer_later(
          tl::unexpected(trouble(fmt::format("position {} of the schedule: {}", k + 1, fits.error().message))));
    }
  }
  schedule_ = std::move(*schedule);
  answer_later(uds::write_response(profile::kept_schedule_did));
}

void MovePort::begin_rotation() {
  if (!schedule_ || turning() || !session_open_) {
    return answer_later(tl::unexpected(trouble(!schedule_  ? "the rotation has no schedule: none was written"
                                               : turning() ? "a rotation is under way already"
                                                           : "no move is commanded without a session")));
  }
  sequence_.begin(*schedule_, move().turning, now_s());
  recording_ = ended_ = stopped_ = false;
  unsaid_.clear();
  not_taken_.clear();
  start_ = request_;
  wanted_ = Own::move;
  watch();
  next();
}

void MovePort::pass_on() {
  pending_ = false;
  passed_on_ = true;
  ins_->request(request_, longest_answer_, [this](Answer<Bytes> answer) { take_answer(std::move(answer)); });
}

void MovePort::take_answer(Answer<Bytes> response) {
  passed_on_ = false;
  if (response && request_ == uds::read_request(*config_.profile->state.did)) {
    const auto state = state_in(*response);
    if (state && lost(*state)) {  // asked again when it is stopped
      pending_ = true;
      wanted_ = Own::stop_lost;
      return next();
    }
  }
  response = as_told(std::move(response));
  const auto done = std::exchange(done_, {});
  next();  // what is due here goes before what the service asks next
  if (done) {
    done(std::move(response));
  }
}

void MovePort::cancel() {
  done_ = {};
  pending_ = false;
  timers_.cancel(std::exchange(answer_timer_, 0));
  if (!start_.empty()) {  // on the way to the first position
    start_.clear();
    sequence_.stop();
    stopped_ = true;
    wanted_ = Own::nothing;
  }
  if (passed_on_) {
    passed_on_ = false;
    ins_->cancel();
    next();
  }
}

void MovePort::answer(Answer<Bytes> response) {
  if (const auto done = std::exchange(done_, {})) {
    done(std::move(response));
  }
}

// From the loop, never from inside request().
void MovePort::answer_later(Answer<Bytes> response) {
  timers_.cancel(answer_timer_);
  answer_timer_ = timers_.after(0ns, [this, response = std::move(response)]() mutable {
    answer_timer_ = 0;
    answer(std::move(response));
  });
}

// What the INS answered to the service, as an INS with a schedule would.
Answer<Bytes> MovePort::as_told(Answer<Bytes> response) {
  const profile::Profile& p = *config_.profile;
  if (!response) {
    const bool ends = request_ == uds::routine_request(RoutineAction::stop, *p.rotate.id);
    const bool none = is(response.error(), {Nrc::request_sequence_error, Nrc::conditions_not_correct});
    if (ends && !recording_ && none) {  // it has none to end
      return uds::routine_response({RoutineAction::stop, *p.rotate.id, {}});
    }
    return response;
  }
  if (request_ == uds::read_request(*p.state.did)) {
    const auto state = state_in(*response);
    if (!state) {
      return tl::unexpected(trouble(state.error().message));
    }
    observe(*state);
    return state_as_told(*state);
  }
  if (request_ == uds::read_request(*p.directory.did)) {
    return directory_as_told(*response);
  }
  if (request_ == uds::routine_request(RoutineAction::result, *p.rotate.id)) {
    return result_as_told(*response);
  }
  if (request_ == uds::routine_request(RoutineAction::stop, *p.rotate.id)) {
    ended_ = ended_ || sequence_.phase() == Phase::over;
  }
  return response;
}

Answer<Bytes> MovePort::state_as_told(ins::StateRecord state) {
  if (!unsaid_.empty()) {
    PortError told = trouble(std::exchange(unsaid_, {}));
    told.kind = PortError::Kind::ended;
    return tl::unexpected(std::move(told));
  }
  state.state = as_rotation(state.state);
  return uds::read_response(*told_->state.did, profile::encode(*told_, state).value());
}

// How many pages are to come the INS does not know; how many there were, once it has recorded all of them, it does.
Answer<Bytes> MovePort::directory_as_told(const Bytes& response) {
  const std::uint16_t did = *told_->directory.did;
  const auto record = uds::read_read_response(response, did);
  auto directory = record ? profile::decode_directory(*config_.profile, *record) : tl::unexpected(record.error());
  if (!directory) {
    return tl::unexpected(trouble(directory.error().message));
  }
  pages_written_ = directory->pages_written;
  directory->pages_expected = ended_ && directory->complete ? directory->pages_written : 0;
  return uds::read_response(did, profile::encode(*told_, *directory).value());
}

Answer<Bytes> MovePort::result_as_told(const Bytes& response) const {
  const uds::RoutineCall call{RoutineAction::result, *told_->rotate.id, {}};
  const auto record = uds::read_routine_response(response, call.action, call.routine);
  auto run = record ? profile::decode_run(*config_.profile, *record) : tl::unexpected(record.error());
  if (!run) {
    return tl::unexpected(trouble(run.error().message));
  }
  run->state = as_rotation(run->state);
  run->position = static_cast<std::uint8_t>(turning() ? sequence_.position() : 0);
  return uds::routine_response(call, profile::encode(*told_, *run).value());
}

// Without the interface, which begins the whole message.
std::string MovePort::words_of(const PortError& error) const {
  const std::string prefix = fmt::format("{}: ", interface());
  return error.message.starts_with(prefix) ? error.message.substr(prefix.size()) : error.message;
}

PortError MovePort::trouble(const std::string& what) const {
  return {PortError::Kind::protocol, 0, fmt::format("{}: {}", interface(), what)};
}

// --- our own requests

// One at a time, and what is due here first.
void MovePort::next() {
  if (own_ != Own::nothing || passed_on_) {
    return;
  }
  if (wanted_ != Own::nothing && again_timer_ == 0) {
    return send(std::exchange(wanted_, Own::nothing));
  }
  if (std::exchange(look_due_, false)) {
    return send(Own::look);
  }
  if (pending_) {
    pass_on();
  }
}

Bytes MovePort::payload_of(Own what) const {
  const profile::Profile& p = *config_.profile;
  switch (what) {
    case Own::move: {
      const auto& position = schedule_->positions[sequence_.position() - 1];
      const Bytes record = profile::encode(p, record_of(position)).value();  // see keep_schedule
      return move().did ? uds::write_request(*move().did, record)
                        : uds::routine_request(RoutineAction::start, *move().routine, record);
    }
    case Own::start: return start_;
    case Own::look: return uds::read_request(*p.state.did);
    default: return uds::routine_request(RoutineAction::stop, *p.rotate.id);
  }
}

void MovePort::send(Own what) {
  own_ = what;
  ins_->request(payload_of(what), longest_answer_to_own, [this, what](const Answer<Bytes>& response) {
    own_ = Own::nothing;
    take_own(what, response);
    next();
  });
}

Expected<void> MovePort::fault_of(Own what, const Bytes& response) const {
  if (what == Own::move && move().did) {
    return uds::read_write_response(response, *move().did);
  }
  const std::uint16_t routine = what == Own::move ? *move().routine : *config_.profile->rotate.id;
  const bool starts = what == Own::move || what == Own::start;
  const auto record =
      uds::read_routine_response(response, starts ? RoutineAction::start : RoutineAction::stop, routine);
  return record ? Expected<void>() : tl::unexpected(record.error());
}

void MovePort::take_own(Own what, const Answer<Bytes>& response) {
  if (what == Own::look) {
    return take_look(response);
  }
  const bool refused = !response && response.error().kind == PortError::Kind::negative;
  moved_ = moved_ || (what == Own::move && !refused);
  if (!response) {
    return not_done(what, response.error());
  }
  if (const auto well = fault_of(what, *response); !well) {
    return not_done(what, trouble(well.error().message));
  }
  busy_ = 0;
  not_taken_.clear();
  if (what == Own::start && !start_.empty()) {  // else nobody waits for it any more: the service stops it
    start_.clear();
    recording_ = true;
    sequence_.data_begin(now_s());
    watch();
    answer_later(*response);
  } else if (what == Own::start) {
    recording_ = true;
  } else if (what == Own::end) {
    ended_ = true;
  } else if (what == Own::stop_lost) {
    stopped_ = true;
  }
}

// An INS that is silent or has lost its session for a while is asked again, for as long as a move may take.
void MovePort::not_done(Own what, const PortError& error) {
  const bool superseded = (what == Own::move && !waits()) || (what == Own::start && start_.empty());
  if (superseded) {
    return;
  }
  if (is(error, {Nrc::busy_repeat_request}) && ++busy_ <= busy_repeats) {
    wanted_ = what;
    return try_again(busy_pause);
  }
  if (what == Own::stop_lost) {
    pending_ = false;
    return answer_later(tl::unexpected(PortError{
        error.kind, error.nrc,
        fmt::format("{}: the rotation that was under way is not stopped: {}", interface(), words_of(error))}));
  }
  const bool away = error.kind == PortError::Kind::link;
  const bool locked = is(error, {Nrc::security_access_denied, Nrc::service_not_supported_in_session,
                                 Nrc::sub_function_not_supported_in_session});
  const bool in_time = waits() || now_s() - sequence_.dwell_end_s() <= move().turning.longest_move_s;
  if ((away || locked) && recording_ && in_time && what != Own::start) {
    not_taken_ = words_of(error);
    wanted_ = what;
    return try_again(retry_interval);
  }
  if (what == Own::move) {
    const auto target = sequence_.target();
    return break_off(fmt::format("the move to {:.3f} and {:.3f} deg is not taken: {}", target[0] / radians_per_degree,
                                 target[1] / radians_per_degree, words_of(error)),
                     error);
  }
  if (what == Own::start) {
    start_.clear();
    sequence_.stop();
    return answer_later(tl::unexpected(error));
  }
  break_off(fmt::format("the recording is not ended: {}", words_of(error)));
}

void MovePort::try_again(std::chrono::nanoseconds after) {
  timers_.cancel(again_timer_);
  again_timer_ = timers_.after(after, [this] {
    again_timer_ = 0;
    next();
  });
}

// The next look at the state.
void MovePort::watch() {
  timers_.cancel(std::exchange(watch_timer_, 0));
  const bool dwells = sequence_.phase() == Phase::dwelling && recording_;
  if (!waits() && !dwells) {
    return;
  }
  const double wait_s = dwells ? std::max(0.0, sequence_.dwell_end_s() - now_s()) : look_interval_s;
  const auto real = std::chrono::nanoseconds(std::llround(wait_s / config_.time_scale * 1e9));
  watch_timer_ = timers_.after(std::max<std::chrono::nanoseconds>(real, shortest_look_interval), [this] {
    watch_timer_ = 0;
    look_due_ = true;
    next();
  });
}

// An answer that makes no sense may be the one to another tester's question: the service, which asks too, judges that.
void MovePort::take_look(const Answer<Bytes>& response) {
  const auto state = response ? state_in(*response) : tl::unexpected(Error{ErrorKind::device, {}});
  if (state) {
    observe(*state);
  } else if (!response && !start_.empty() && response.error().kind == PortError::Kind::link) {
    break_off(words_of(response.error()), response.error());  // the service finds the INS again
  } else if (waits()) {
    not_taken_ = response ? state.error().message : words_of(response.error());
    const Phase before = sequence_.phase();
    sequence_.on_time(now_s(), nullptr);
    take_phase(before);
  }
  if (watch_timer_ == 0) {
    watch();
  }
}

}  // namespace selfcal
