#include "sim_ins/device/diagnostics.hpp"

#include <sys/random.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "protocol/byte_order.hpp"
#include "protocol/ins_interface/identifiers.hpp"

namespace selfcal::sim {
namespace {

using uds::Nrc;

constexpr std::string_view software_version = "sim_ins 1.0";
constexpr std::uint32_t free_attempts = 3;  // wrong keys before the delay
constexpr Time delay_after_wrong_keys = std::chrono::seconds(10);
constexpr uds::SessionTimings timings{std::chrono::milliseconds(50), std::chrono::seconds(5)};

uds::Bytes as_bytes(std::string_view text) { return {text.begin(), text.end()}; }

template <typename Array>
uds::Bytes as_bytes(const Array& array) requires requires {
  array.size();
} &&(!std::is_convertible_v<Array, std::string_view>) {
  return {array.begin(), array.end()};
}

}  // namespace

Diagnostics::Diagnostics(Instrument& instrument, const DiagnosticOptions& options)
    : instrument_(instrument), options_(options) {}

void Diagnostics::power_on(Time now) {
  session_expired(now);
  seed_.reset();
  reset_wanted_ = false;
  answer_.reset();
  pages_served_ = 0;
  // The delay survives a reset: else a reset would be the way round it.
  locked_until_ = instrument_.counters().get().wrong_keys >= free_attempts ? now + delay_after_wrong_keys : Time{0};
}

void Diagnostics::session_expired(Time) {
  session_ = uds::Session::standard;
  unlocked_ = false;
  upload_.reset();
}

uds::RequestHandler::Answer Diagnostics::handle(View request, uds::Bytes& response, Time now) {
  const double written_before_s = instrument_.flash().ready_at_s();
  const Reply reply =
      options_.answer_all_with ? Reply(tl::unexpected(*options_.answer_all_with)) : dispatch(request, now, response);
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
  if (!answer_ || now_s_ < answer_->due_s) {
    return std::nullopt;
  }
  return std::exchange(answer_, std::nullopt)->response;
}

Diagnostics::Reply Diagnostics::dispatch(View request, Time now, uds::Bytes& response) {
  switch (request[0]) {
    case uds::service::session_control: return session_control(request);
    case uds::service::ecu_reset: return ecu_reset(request);
    case uds::service::security_access: return security_access(request, now);
    case uds::service::read_data: return read_data(request);
    case uds::service::write_data: return write_data(request);
    case uds::service::routine_control: return routine(request);
    case uds::service::request_upload: return request_upload(request);
    case uds::service::transfer_data: return transfer(request, response);
    case uds::service::transfer_exit:
      if (request.size() != 1) {
        return tl::unexpected(Nrc::incorrect_message_length);
      }
      if (!upload_) {
        return tl::unexpected(Nrc::request_sequence_error);
      }
      upload_.reset();
      return uds::transfer_exit_response();
    case uds::service::tester_present:
      if (request.size() != 2) {
        return tl::unexpected(Nrc::incorrect_message_length);
      }
      if ((request[1] & ~uds::suppress_response_bit) != 0) {
        return tl::unexpected(Nrc::sub_function_not_supported);
      }
      return uds::Bytes{uds::service::tester_present + uds::positive_offset, 0};
    default: return tl::unexpected(Nrc::service_not_supported);
  }
}

Nrc Diagnostics::why_not_change() const {
  return session_ == uds::Session::standard ? Nrc::service_not_supported_in_session : Nrc::security_access_denied;
}

Diagnostics::Reply Diagnostics::session_control(View request) {
  if (request.size() != 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  const auto session = static_cast<uds::Session>(request[1] & ~uds::suppress_response_bit);
  if (session != uds::Session::standard && session != uds::Session::programming && session != uds::Session::extended) {
    return tl::unexpected(Nrc::sub_function_not_supported);
  }
  if (session != session_) {  // a change of session locks again
    unlocked_ = false;
    upload_.reset();
  }
  session_ = session;
  return uds::session_response(session, timings);
}

Diagnostics::Reply Diagnostics::ecu_reset(View request) {
  if (request.size() != 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  const auto type = static_cast<std::uint8_t>(request[1] & ~uds::suppress_response_bit);
  if (type != static_cast<std::uint8_t>(uds::ResetType::hard) &&
      type != static_cast<std::uint8_t>(uds::ResetType::key_off_on)) {
    return tl::unexpected(Nrc::sub_function_not_supported);
  }
  if (!may_change()) {
    return tl::unexpected(why_not_change());
  }
  reset_wanted_ = true;
  return uds::Bytes{uds::service::ecu_reset + uds::positive_offset, type};
}

Diagnostics::Reply Diagnostics::security_access(View request, Time now) {
  if (request.size() < 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (session_ == uds::Session::standard) {
    return tl::unexpected(Nrc::service_not_supported_in_session);
  }
  const auto level = static_cast<std::uint8_t>(request[1] & ~uds::suppress_response_bit);
  if (level == uds::security_seed_level) {
    return request.size() == 2 ? give_seed(now) : Reply(tl::unexpected(Nrc::incorrect_message_length));
  }
  if (level == uds::security_key_level) {
    return request.size() == 2 + uds::seed_bytes ? take_key(request.subspan(2), now)
                                                 : Reply(tl::unexpected(Nrc::incorrect_message_length));
  }
  return tl::unexpected(Nrc::sub_function_not_supported);
}

Diagnostics::Reply Diagnostics::give_seed(Time now) {
  if (now < locked_until_) {
    return tl::unexpected(Nrc::required_time_delay_not_expired);
  }
  std::array<std::uint8_t, uds::seed_bytes> seed{};
  if (unlocked_) {  // all zeros: nothing to answer
    return uds::seed_response(seed);
  }
  if (options_.seed_salt != 0) {
    ByteWriter writer(seed);
    writer.put(options_.seed_salt);
    writer.put(++seeds_given_);
  } else if (::getrandom(seed.data(), seed.size(), 0) != static_cast<ssize_t>(seed.size())) {
    return tl::unexpected(Nrc::conditions_not_correct);
  }
  seed_ = seed;
  return uds::seed_response(seed);
}

Diagnostics::Reply Diagnostics::take_key(View key, Time now) {
  if (!seed_) {
    return tl::unexpected(Nrc::request_sequence_error);
  }
  const auto expected = uds::answer_seed(options_.key, *seed_);
  seed_.reset();  // an answer counts once: a recorded one is worth nothing
  const Counters& counters = instrument_.counters().get();
  if (!expected || !uds::equal_in_constant_time(*expected, key)) {
    const std::uint32_t wrong = counters.wrong_keys + 1;
    instrument_.counters().set(counters.power_cycles, wrong);
    if (wrong >= free_attempts) {
      locked_until_ = now + delay_after_wrong_keys;
      return tl::unexpected(Nrc::exceeded_number_of_attempts);
    }
    return tl::unexpected(Nrc::invalid_key);
  }
  if (counters.wrong_keys != 0) {
    instrument_.counters().set(counters.power_cycles, 0);
  }
  unlocked_ = true;
  return uds::Bytes{uds::service::security_access + uds::positive_offset, uds::security_key_level};
}

Diagnostics::Reply Diagnostics::read_data(View request) {
  if (request.size() != 3) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  const auto id = ByteReader(request.subspan(1)).get<std::uint16_t>();
  const auto record = [&]() -> std::optional<uds::Bytes> {
    switch (id) {
      case ins::did::serial_number: return as_bytes(std::string_view(instrument_.serial()));
      case ins::did::software_version: return as_bytes(software_version);
      case ins::did::state: return ins::encode(instrument_.state_record());
      case ins::did::schedule:
        return instrument_.schedule() ? std::optional(ins::encode(*instrument_.schedule())) : std::nullopt;
      case ins::did::site: return ins::encode(instrument_.site());
      case ins::did::coefficients_in_force: return as_bytes(ins::encode(instrument_.coefficients().in_force()));
      case ins::did::coefficients_inactive: {
        const auto set = instrument_.coefficients().inactive();
        return set ? std::optional(as_bytes(ins::encode(*set))) : std::nullopt;
      }
      case ins::did::coefficients_factory: {
        const auto set = instrument_.coefficients().factory();
        return set ? std::optional(as_bytes(ins::encode(*set))) : std::nullopt;
      }
      case ins::did::raw_data_directory: return ins::encode(instrument_.raw().directory());
      case ins::did::sample_format: return ins::encode(instrument_.sample_format());
      default: return std::nullopt;
    }
  }();
  if (!record) {
    const bool known = std::any_of(ins::data_identifiers.begin(), ins::data_identifiers.end(),
                                   [id](const ins::DataIdentifier& d) { return d.id == id; });
    return tl::unexpected(known ? Nrc::conditions_not_correct : Nrc::request_out_of_range);
  }
  return uds::read_response(id, *record);
}

Diagnostics::Reply Diagnostics::write_data(View request) {
  if (request.size() < 4) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  const auto id = ByteReader(request.subspan(1)).get<std::uint16_t>();
  const View record = request.subspan(3);
  const auto known = std::find_if(ins::data_identifiers.begin(), ins::data_identifiers.end(),
                                  [id](const ins::DataIdentifier& d) { return d.id == id; });
  if (known == ins::data_identifiers.end() || !known->writable) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  if (!may_change()) {
    return tl::unexpected(why_not_change());
  }
  if (instrument_.busy()) {
    return tl::unexpected(Nrc::conditions_not_correct);
  }
  if (id == ins::did::schedule) {
    const auto schedule = ins::decode_schedule(record);
    if (!schedule || !instrument_.set_schedule(*schedule)) {
      return tl::unexpected(Nrc::request_out_of_range);
    }
  } else if (id == ins::did::site) {
    const auto site = ins::decode_site(record);
    if (!site) {
      return tl::unexpected(Nrc::request_out_of_range);
    }
    instrument_.set_site(*site);
  } else {
    const auto set = ins::decode_coefficients(record);
    if (!set) {
      return tl::unexpected(Nrc::request_out_of_range);
    }
    if (!instrument_.coefficients().write_inactive(*set)) {
      return tl::unexpected(Nrc::general_programming_failure);  // not erased
    }
  }
  return uds::write_response(id);
}

Diagnostics::Reply Diagnostics::routine(View request) {
  const auto call = uds::parse_routine_request(request);
  if (!call) {
    return tl::unexpected(call.error());
  }
  const bool known = std::any_of(ins::routines.begin(), ins::routines.end(),
                                 [&](const ins::Routine& r) { return r.id == call->routine; });
  if (!known) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  if (call->action == uds::RoutineAction::result) {
    if (call->routine == ins::routine::self_calibration) {
      return uds::routine_response(*call, ins::encode(instrument_.run_record()));
    }
    if (call->routine == ins::routine::navigation_check) {
      return uds::routine_response(*call, ins::encode(instrument_.navigation_check()));
    }
    return uds::routine_response(*call);
  }
  if (!may_change()) {
    return tl::unexpected(why_not_change());
  }
  if (call->action == uds::RoutineAction::stop) {
    instrument_.stop();
    return uds::routine_response(*call);
  }
  return start_routine(*call);
}

Diagnostics::Reply Diagnostics::start_routine(const uds::RoutineCall& call) {
  ByteReader option(call.option);
  bool done = false;
  if (call.routine == ins::routine::self_calibration || call.routine == ins::routine::commit_coefficients) {
    const auto word = option.get<std::uint32_t>();
    if (!option.ok() || option.left() != 0) {
      return tl::unexpected(Nrc::incorrect_message_length);
    }
    if (call.routine == ins::routine::commit_coefficients) {
      if (instrument_.busy()) {
        return tl::unexpected(Nrc::conditions_not_correct);
      }
      if (!instrument_.coefficients().commit_inactive(word)) {
        return tl::unexpected(Nrc::request_out_of_range);
      }
      done = true;
    } else {
      done = instrument_.start_rotation(word, now_s_).has_value();
      pages_served_ = 0;
      upload_.reset();
    }
  } else if (call.routine == ins::routine::erase_inactive) {
    if (instrument_.busy()) {
      return tl::unexpected(Nrc::conditions_not_correct);
    }
    instrument_.coefficients().erase_inactive();
    done = true;
  } else {
    const auto request = ins::decode_navigation_request(call.option);
    if (!request) {
      return tl::unexpected(Nrc::request_out_of_range);
    }
    done = instrument_.start_navigation_check(*request, now_s_).has_value();
  }
  return done ? Reply(uds::routine_response(call)) : Reply(tl::unexpected(Nrc::conditions_not_correct));
}

Diagnostics::Reply Diagnostics::request_upload(View request) {
  const auto range = uds::parse_upload_request(request);
  if (!range) {
    return tl::unexpected(range.error());
  }
  if (session_ == uds::Session::standard) {
    return tl::unexpected(Nrc::service_not_supported_in_session);
  }
  const ins::DirectoryRecord directory = instrument_.raw().directory();
  const std::uint64_t end = std::uint64_t{range->first_page} * flash::page_bytes + range->bytes;
  if (range->bytes == 0 || range->first_page < directory.first_page ||
      end > std::uint64_t{directory.pages_written} * flash::page_bytes) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  upload_ = Upload{range->first_page, range->bytes, 0, 1, 0};
  return uds::upload_response(options_.longest_response);
}

Diagnostics::Reply Diagnostics::transfer(View request, uds::Bytes& response) {
  if (request.size() != 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (!upload_) {
    return tl::unexpected(Nrc::request_sequence_error);
  }
  Upload& u = *upload_;
  const std::uint8_t block = request[1];
  if (block == static_cast<std::uint8_t>(u.next_block - 1) && u.last_size > 0) {
    u.done -= u.last_size;  // the block before, asked for again
  } else if (block == u.next_block) {
    ++u.next_block;
  } else {
    return tl::unexpected(Nrc::wrong_block_sequence_counter);
  }
  const auto room = options_.longest_response - static_cast<std::uint32_t>(uds::transfer_overhead);
  u.last_size = std::min(room, u.bytes - u.done);
  if (u.last_size == 0) {
    return tl::unexpected(Nrc::request_sequence_error);
  }
  uds::Bytes data;
  data.reserve(u.last_size);
  for (std::uint32_t at = u.done; at < u.done + u.last_size;) {
    const std::uint32_t page = u.first_page + at / static_cast<std::uint32_t>(flash::page_bytes);
    const std::uint32_t offset = at % static_cast<std::uint32_t>(flash::page_bytes);
    const std::uint32_t part =
        std::min(static_cast<std::uint32_t>(flash::page_bytes) - offset, u.done + u.last_size - at);
    const auto bytes = instrument_.raw().page(page).subspan(offset, part);
    data.insert(data.end(), bytes.begin(), bytes.end());
    if (instrument_.raw().spoilt() == page && part > 64) {
      data.back() ^= 0x40;
      instrument_.raw().mend();
    }
    at += part;
  }
  u.done += u.last_size;
  pages_served_ = std::max(pages_served_, u.first_page + u.done / static_cast<std::uint32_t>(flash::page_bytes));
  uds::transfer_response(block, data, response);
  return uds::Bytes{};
}

}  // namespace selfcal::sim
