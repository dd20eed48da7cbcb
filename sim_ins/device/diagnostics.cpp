#include "sim_ins/device/diagnostics.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "protocol/profile/records.hpp"

namespace selfcal::sim {
namespace {

using uds::Nrc;
namespace service = uds::service;

constexpr uds::SessionTimings timings{std::chrono::milliseconds(50), std::chrono::seconds(5)};

// What figures 5 and 6 ask of every request. No sub-function depends on the session other than through its service, so
// that subFunctionNotSupportedInActiveSession (0x7E) never comes.
struct ServiceRule {
  std::uint8_t id;
  bool in_default_session;
  std::size_t shortest;         // service and sub-function, or what the service's own figure says
  std::uint16_t sub_functions;  // bit per value; 0: the service has none
};
constexpr std::uint16_t values(std::initializer_list<unsigned> list) {
  unsigned bits = 0;
  for (const unsigned value : list) {
    bits |= 1U << value;
  }
  return static_cast<std::uint16_t>(bits);
}
constexpr std::array<ServiceRule, 13> service_rules = {{
    {service::session_control, true, 2, values({1, 2, 3})},
    {service::ecu_reset, false, 2, values({1, 2})},
    {service::read_data, true, 3, 0},
    {service::security_access, false, 2, values({uds::security_seed_level, uds::security_key_level})},
    {service::write_data, false, 4, 0},
    {service::routine_control, false, 2, values({1, 2, 3})},
    {service::read_memory, false, 4, 0},
    {service::request_upload, false, 5, 0},
    {service::transfer_data, false, 2, 0},
    {service::transfer_exit, false, 1, 0},
    {service::file_transfer, false, 6, 0},
    {service::write_memory, false, 5, 0},
    {service::tester_present, true, 2, values({0})},
}};

tl::unexpected<Nrc> no(Nrc nrc) { return tl::unexpected(nrc); }

bool has_records(const profile::Profile& profile) { return !profile.memory.regions.empty(); }

}  // namespace

Diagnostics::Diagnostics(Instrument& instrument, const DiagnosticOptions& options)
    : instrument_(instrument),
      profile_(options.profile),
      lock_(instrument.flash(), instrument.counters(), options.profile->security, options.key, options.seed_salt),
      upload_(instrument.raw(), options.longest_response, options.profile) {}

void Diagnostics::power_on(Time now) {
  enter(uds::Session::standard);
  lock_.power_on(now);
  upload_.forget();
  reset_wanted_ = calibration_started_ = check_started_ = false;
  answer_.reset();
}

// Also into the session that it is in: security goes with every transition (ISO 14229-1, 9.2.1).
void Diagnostics::enter(uds::Session session) {
  session_ = session;
  lock_.close();
  upload_.drop();
  begun_.reset();
}

void Diagnostics::session_expired(Time) { enter(uds::Session::standard); }

uds::RequestHandler::Answer Diagnostics::handle(View request, uds::Bytes& response, Time now) {
  const double written_before_s = instrument_.flash().ready_at_s();
  const Reply reply = refusal_ ? Reply(no(*refusal_)) : dispatch(request, now, response);
  if (lock_.busy()) {
    return Answer::later;
  }
  if (!reply) {
    const auto negative = uds::negative_response(request[0], reply.error());
    response.assign(negative.begin(), negative.end());
  } else if (!reply->empty()) {
    response = *reply;
  }
  const double written_at_s = instrument_.flash().ready_at_s();
  if (written_at_s <= written_before_s) {
    return Answer::now;
  }
  answer_ = Waiting{response, written_at_s};  // nothing is said to be written before it is
  return Answer::later;
}

std::optional<uds::Bytes> Diagnostics::take_answer() {
  if (const auto reply = lock_.take_answer(now_s_)) {
    if (*reply) {
      uds::Bytes response = **reply;
      response[1] = static_cast<std::uint8_t>(profile_->security.level + 1U);
      return response;
    }
    const auto negative = uds::negative_response(service::security_access, reply->error());
    return uds::Bytes(negative.begin(), negative.end());
  }
  if (!answer_ || now_s_ < answer_->due_s) {
    return std::nullopt;
  }
  return std::exchange(answer_, std::nullopt)->response;
}

// There is one way to the raw data, and what belongs to the others is no service of this INS.
bool Diagnostics::profile_has(std::uint8_t id) const {
  using Way = profile::Raw::Way;
  const Way way = profile_->raw.way;
  switch (id) {
    case service::read_memory: return way == Way::memory || has_records(*profile_);
    case service::write_memory: return has_records(*profile_);
    case service::request_upload: return way == Way::upload;
    case service::file_transfer: return way == Way::file;
    case service::transfer_data:
    case service::transfer_exit: return way == Way::upload || way == Way::file;
    default: return true;
  }
}

// Figures 5 and 6, without security, which here belongs to sub-functions, identifiers and routines.
Nrc Diagnostics::general_objection(View request) const {
  const auto rule = std::ranges::find(service_rules, request[0], &ServiceRule::id);
  if (rule == service_rules.end() || !profile_has(request[0])) {
    return Nrc::service_not_supported;
  }
  const bool reads_records = rule->id == service::read_memory && has_records(*profile_);
  if (session_ == uds::Session::standard && !rule->in_default_session && !reads_records) {
    return Nrc::service_not_supported_in_session;
  }
  if (request.size() < rule->shortest) {
    return Nrc::incorrect_message_length;
  }
  if (rule->sub_functions != 0) {
    const unsigned value = request[1] & ~unsigned{uds::suppress_response_bit};
    const unsigned level = profile_->security.level;
    const bool of_profile = (rule->id == service::session_control && value == profile_->session) ||
                            (rule->id == service::security_access && (value == level || value == level + 1));
    const bool other_level = rule->id == service::security_access && !of_profile;
    if (of_profile) {
      return Nrc::none;
    }
    if (other_level || value > 15 || (rule->sub_functions >> value & 1U) == 0) {
      return Nrc::sub_function_not_supported;
    }
  }
  return Nrc::none;
}

Diagnostics::Reply Diagnostics::dispatch(View request, Time now, uds::Bytes& response) {
  if (const Nrc nrc = general_objection(request); nrc != Nrc::none) {
    return no(nrc);
  }
  switch (request[0]) {
    case service::session_control: return session_control(request);
    case service::ecu_reset: return ecu_reset(request);
    case service::security_access: return security_access(request, now);
    case service::read_data: return read_data(request);
    case service::write_data: return write_data(request);
    case service::routine_control: return routine(request);
    case service::read_memory: return read_memory(request);
    case service::write_memory: return write_memory(request);
    case service::request_upload: return upload_.request(request);
    case service::file_transfer: return upload_.file(request);
    case service::transfer_data: return upload_.transfer(request, response);
    case service::transfer_exit: return upload_.exit(request);
    default:
      return request.size() == 2 ? Reply(uds::Bytes{service::tester_present + uds::positive_offset, 0})
                                 : Reply(no(Nrc::incorrect_message_length));
  }
}

Diagnostics::Reply Diagnostics::session_control(View request) {
  if (request.size() != 2) {
    return no(Nrc::incorrect_message_length);
  }
  enter(static_cast<uds::Session>(request[1] & ~uds::suppress_response_bit));
  return uds::session_response(session_, timings);
}

Diagnostics::Reply Diagnostics::ecu_reset(View request) {
  if (!unlocked()) {  // figure 6: security of the sub-function before all that is the service's own
    return no(Nrc::security_access_denied);
  }
  if (request.size() != 2) {
    return no(Nrc::incorrect_message_length);
  }
  reset_wanted_ = true;
  return uds::Bytes{service::ecu_reset + uds::positive_offset,
                    static_cast<std::uint8_t>(request[1] & ~uds::suppress_response_bit)};
}

Diagnostics::Reply Diagnostics::security_access(View request, Time now) {
  const bool seed_wanted = (request[1] & ~uds::suppress_response_bit) == profile_->security.level;
  if (!seed_wanted && !lock_.seed_given()) {  // figure 6: sequence of the sub-functions
    return no(Nrc::request_sequence_error);
  }
  if (request.size() != (seed_wanted ? 2 : 2 + profile_->security.key_bytes)) {
    return no(Nrc::incorrect_message_length);
  }
  if (seed_wanted) {
    return lock_.give_seed(now).map([&](uds::Bytes response) {
      response[1] = profile_->security.level;
      return response;
    });
  }
  lock_.begin_attempt(request.subspan(2), now);
  return uds::Bytes{};
}

// ISO 14229-1, RoutineControl: length, identifier, its security, sub-function for it, total length, option, sequence,
// conditions.
Diagnostics::Reply Diagnostics::routine(View request) {
  const auto call = uds::parse_routine_request(request);
  if (!call) {
    return no(call.error());
  }
  const profile::Profile& p = *profile_;
  const bool calibration = call->routine == p.rotate.id;
  const bool lasts =
      calibration || call->routine == p.navigation_check.id;  // others have nothing to stop and no result
  const bool of_move = p.move && call->routine == p.move->routine;
  if (!lasts && !of_move && call->routine != p.erase.id && call->routine != p.commit.id) {
    return no(Nrc::request_out_of_range);
  }
  if (!unlocked()) {
    return no(Nrc::security_access_denied);
  }
  if (call->action == uds::RoutineAction::start) {
    return start_routine(*call);
  }
  if (!lasts) {
    return no(Nrc::sub_function_not_supported);
  }
  if (!call->option.empty()) {
    return no(Nrc::incorrect_message_length);
  }
  if (!(calibration ? calibration_started_ : check_started_)) {
    return no(Nrc::request_sequence_error);
  }
  if (call->action == uds::RoutineAction::result) {
    return routine_result(*call);
  }
  calibration ? instrument_.stop_rotation() : instrument_.stop_check();
  return uds::routine_response(*call);
}

Diagnostics::Reply Diagnostics::routine_result(const uds::RoutineCall& call) {
  const auto result = call.routine == profile_->rotate.id ? profile::encode(*profile_, instrument_.run_record())
                                                          : profile::encode(*profile_, instrument_.navigation_check());
  return result ? Reply(uds::routine_response(call, *result)) : Reply(no(Nrc::conditions_not_correct));
}

Diagnostics::Reply Diagnostics::start_routine(const uds::RoutineCall& call) {
  if (call.routine == profile_->rotate.id) {
    return start_calibration(call);
  }
  if (profile_->move && call.routine == profile_->move->routine) {
    return move(call.option).map([&](const uds::Bytes&) { return uds::routine_response(call); });
  }
  if (call.routine == profile_->commit.id) {
    return commit(call);
  }
  if (call.routine == profile_->navigation_check.id) {
    return start_check(call);
  }
  if (!call.option.empty()) {
    return no(Nrc::incorrect_message_length);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  instrument_.coefficients().erase_inactive();
  return uds::routine_response(call);
}

Diagnostics::Reply Diagnostics::start_calibration(const uds::RoutineCall& call) {
  if (!profile::length_fits(profile_->rotate.start, call.option)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto run_id = profile::read_rotation_start(*profile_, call.option);
  if (!run_id) {
    return no(Nrc::request_out_of_range);
  }
  if (!instrument_.start_rotation(*run_id, now_s_)) {
    return no(Nrc::conditions_not_correct);
  }
  calibration_started_ = true;
  upload_.forget();
  return uds::routine_response(call);
}

Diagnostics::Reply Diagnostics::commit(const uds::RoutineCall& call) {
  if (!profile::length_fits(profile_->commit.start, call.option)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto set = instrument_.coefficients().inactive();
  const auto bytes = set ? profile::encode(*profile_, *set) : Expected<uds::Bytes>(uds::Bytes());
  const auto wanted = set && bytes ? profile::commit_start(*profile_, *bytes) : tl::unexpected(Error{});
  if (!wanted || !std::ranges::equal(*wanted, call.option)) {
    return no(Nrc::request_out_of_range);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  instrument_.coefficients().commit_inactive();
  return uds::routine_response(call);
}

Diagnostics::Reply Diagnostics::start_check(const uds::RoutineCall& call) {
  if (!profile::length_fits(profile_->navigation_check.start, call.option)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto request = profile::decode_navigation_request(*profile_, call.option);
  if (!request) {
    return no(Nrc::request_out_of_range);
  }
  if (!instrument_.start_navigation_check(*request, now_s_)) {
    return no(Nrc::conditions_not_correct);
  }
  check_started_ = true;
  return uds::routine_response(call);
}

}  // namespace selfcal::sim
