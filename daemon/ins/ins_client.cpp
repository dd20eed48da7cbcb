#include "daemon/ins/ins_client.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/ins/kept_form.hpp"
#include "daemon/ins/seed_answer.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

// Longest answers, service and identifier included. The longest record is that of the coefficients, with 263 bytes.
constexpr std::size_t longest_record = 512;
constexpr std::size_t longest_other = 128;
// Where a second tester is on the bus the answer to its question may come first.
constexpr int attempts = 4;
// busyRepeatRequest: ISO 14229-1 has the client repeat the request.
constexpr int busy_repeats = 10;
constexpr auto busy_pause = 100ms;

bool is_busy(const PortError& error) {
  return error.kind == PortError::Kind::negative &&
         error.nrc == static_cast<std::uint8_t>(uds::Nrc::busy_repeat_request);
}

// One request under way; breaking off the task forgets it.
class Exchange {
 public:
  Exchange(InsPort& port, const Bytes& payload, std::size_t longest_answer)
      : port_(port), payload_(payload), longest_answer_(longest_answer) {}
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;
  ~Exchange() {
    if (waiting_) {
      port_.cancel();
    }
  }

  bool await_ready() const noexcept { return false; }
  void await_suspend(std::coroutine_handle<> task) {
    waiting_ = true;
    port_.request(payload_, longest_answer_, [this, task](Answer<Bytes> answer) {
      waiting_ = false;
      answer_ = std::move(answer);
      task.resume();
    });
  }
  Answer<Bytes> await_resume() { return std::move(answer_); }

 private:
  InsPort& port_;
  const Bytes& payload_;
  std::size_t longest_answer_;
  Answer<Bytes> answer_;
  bool waiting_ = false;
};

template <typename Record>
Answer<Record> decoded(const InsPort& port, const profile::Profile& profile, const Answer<Bytes>& bytes,
                       Expected<Record> (*decode)(const profile::Profile&, profile::ByteView)) {
  if (!bytes) {
    return tl::unexpected(bytes.error());
  }
  auto record = decode(profile, *bytes);
  if (!record) {
    return protocol_error(port, record.error());
  }
  return std::move(*record);
}

std::string text(const Bytes& bytes) {
  std::string result(bytes.begin(), bytes.end());
  std::erase_if(result, [](char c) { return c < 0x20 || c > 0x7E; });  // padding, and what no serial number holds
  return result;
}

// In memory a text has a fixed length: blanks behind it may be padding too.
std::string text_of(const profile::Profile& profile, std::uint16_t did, const Bytes& bytes) {
  std::string result = text(bytes);
  if (profile.memory.find(did) != nullptr) {
    result.erase(result.find_last_not_of(' ') + 1);
  }
  return result;
}

}  // namespace

tl::unexpected<PortError> protocol_error(const InsPort& port, const Error& error) {
  return tl::unexpected<PortError>(
      PortError{PortError::Kind::protocol, 0, fmt::format("{}: {}", port.interface(), error.message)});
}

Task<Answer<Bytes>> InsClient::ask(Bytes payload, std::size_t longest_answer) {
  for (int busy = 0;; ++busy) {
    tally_.asked(payload);
    Exchange exchange(port_, payload, longest_answer);
    Answer<Bytes> answer = co_await exchange;
    if (answer) {
      co_return answer;
    }
    if (!is_busy(answer.error()) || busy == busy_repeats) {
      tally_.failed(payload, answer.error().message);
      co_return answer;
    }
    co_await Sleep(timers_, busy_pause);
  }
}

Task<Answer<Bytes>> InsClient::read_record(std::uint16_t did) {
  for (int attempt = 1;; ++attempt) {
    const Answer<Bytes> response = co_await ask(uds::read_request(did), longest_record);
    if (!response) {
      if (response.error().kind == PortError::Kind::protocol && attempt < attempts) {
        continue;
      }
      co_return tl::unexpected(response.error());
    }
    const auto record = uds::read_read_response(*response, did);
    if (record) {
      co_return Bytes(record->begin(), record->end());
    }
    if (attempt == attempts) {
      co_return protocol_error(port_, record.error());
    }
  }
}

Task<Answer<Done>> InsClient::write_record(std::uint16_t did, Bytes record) {
  const Answer<Bytes> response = co_await ask(uds::write_request(did, record), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  if (const auto well = uds::read_write_response(*response, did); !well) {
    co_return protocol_error(port_, well.error());
  }
  co_return Done{};
}

Task<Answer<Bytes>> InsClient::routine(uds::RoutineAction action, std::uint16_t routine, Bytes option) {
  const Answer<Bytes> response = co_await ask(uds::routine_request(action, routine, option), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  const auto record = uds::read_routine_response(*response, action, routine);
  if (!record) {
    co_return protocol_error(port_, record.error());
  }
  co_return Bytes(record->begin(), record->end());
}

Task<Answer<InsClient::Identity>> InsClient::identify() {
  const Answer<Bytes> serial = co_await read_record(profile_->serial);
  if (!serial) {
    co_return tl::unexpected(serial.error());
  }
  const Answer<Bytes> software = co_await read_record(profile_->software);
  if (!software) {
    co_return tl::unexpected(software.error());
  }
  Identity identity{text_of(*profile_, profile_->serial, *serial), text_of(*profile_, profile_->software, *software)};
  if (identity.serial.empty()) {
    co_return protocol_error(port_, {ErrorKind::device, "the INS tells an empty serial number"});
  }
  co_return identity;
}

Task<Answer<Done>> InsClient::unlock(UnlockKey key) {
  session_asked_for_ = true;
  const auto session = static_cast<uds::Session>(profile_->session);
  const std::uint8_t level = profile_->security.level;
  Answer<Bytes> response = co_await ask(uds::session_request(session), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  const auto timings = uds::read_session_response(*response, session);
  if (!timings) {
    co_return protocol_error(port_, timings.error());
  }
  port_.take_timings(*timings);
  port_.keep_session(true);
  if (!profile_->security.needed) {
    co_return Done{};
  }
  response = co_await ask(uds::seed_request(level), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  const auto seed = uds::read_seed_response(*response, level, profile_->security.seed_bytes);
  if (!seed) {
    co_return protocol_error(port_, seed.error());
  }
  if (std::all_of(seed->begin(), seed->end(), [](std::uint8_t byte) { return byte == 0; })) {
    co_return Done{};
  }
  const auto secret = co_await answer_seed(timers_, profile_->security, key, *seed);
  if (!secret) {
    co_return tl::unexpected<PortError>(PortError{PortError::Kind::local, 0, secret.error().message});
  }
  response = co_await ask(uds::key_request(*secret, level), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  if (auto well = uds::read_key_response(*response, level); !well) {
    co_return protocol_error(port_, well.error());
  }
  co_return Done{};
}

Task<Answer<ins::StateRecord>> InsClient::read_state() {
  const Answer<Bytes> bytes = co_await read_record(*profile_->state.did);
  co_return decoded(port_, *profile_, bytes, profile::decode_state);
}

Task<Answer<ins::DirectoryRecord>> InsClient::read_directory() {
  const Answer<Bytes> bytes = co_await read_record(*profile_->directory.did);
  const Answer<ins::DirectoryRecord> directory = decoded(port_, *profile_, bytes, profile::decode_directory);
  run_held_ = directory ? directory->run_id : run_held_;
  co_return directory;
}

Task<Answer<ins::SampleFormatRecord>> InsClient::read_sample_format() {
  if (!profile_->sample_format.did) {  // the profile gives it
    co_return decoded(port_, *profile_, Answer<Bytes>(Bytes{}), profile::decode_sample_format);
  }
  const Answer<Bytes> bytes = co_await read_record(*profile_->sample_format.did);
  co_return decoded(port_, *profile_, bytes, profile::decode_sample_format);
}

Task<Answer<ins::SiteRecord>> InsClient::read_site() {
  if (!profile_->site.did) {  // the configuration gives it
    co_return ins::SiteRecord{};
  }
  const Answer<Bytes> bytes = co_await read_record(*profile_->site.did);
  co_return decoded(port_, *profile_, bytes, profile::decode_site);
}

// As the INS tells it: one record, or field by field.
Task<Answer<Bytes>> InsClient::told_set(SetOf which) {
  if (!profile_->field_by_field) {
    const bool second = which == SetOf::inactive && profile_->slots;
    co_return co_await read_record(second ? *profile_->set_inactive : *profile_->set_in_force);
  }
  Bytes set;
  for (const profile::Field& field : profile_->set.fields) {
    const Answer<Bytes> part = co_await read_record(*field.did);
    if (!part) {
      co_return part;
    }
    if (part->size() != field.end() - field.at) {
      co_return protocol_error(
          port_, {ErrorKind::device, fmt::format("coefficients: {} has {} bytes, {} expected", field.name, part->size(),
                                                 field.end() - field.at)});
    }
    set.insert(set.end(), part->begin(), part->end());
  }
  co_return set;
}

Task<Answer<Bytes>> InsClient::read_set(SetOf which) {
  Answer<Bytes> told = co_await told_set(which);
  if (!told) {
    co_return told;
  }
  const auto set = profile::decode_coefficients(*profile_, *told);
  co_return set ? set_as_kept(*set) : std::move(*told);
}

// To a fixed point: where the INS's numbers are in other units, a conversion there and back moves the last bit, and the next
// one no more.
Answer<Bytes> InsClient::as_held(const ins::Coefficients& set) const {
  constexpr int rounds = 4;
  ins::Coefficients held = set;
  for (int round = 0; round < rounds; ++round) {
    const auto bytes = profile::encode(*profile_, held);
    const auto again = bytes ? profile::decode_coefficients(*profile_, *bytes) : tl::unexpected(bytes.error());
    if (!again) {
      return protocol_error(port_, again.error());
    }
    if (*again == held) {
      return set_as_kept(held);
    }
    held = *again;
  }
  return protocol_error(port_,
                        {ErrorKind::internal, "the record of coefficients does not settle when it is converted"});
}

Task<Answer<Done>> InsClient::command(uds::RoutineAction action, std::uint16_t id, Expected<Bytes> option) {
  if (!option) {
    co_return protocol_error(port_, option.error());
  }
  const auto done = co_await routine(action, id, std::move(*option));
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  co_return Done{};
}

Task<Answer<Done>> InsClient::erase_inactive() {
  if (!erases()) {
    co_return Done{};
  }
  co_return co_await command(uds::RoutineAction::start, *profile_->erase.id, Bytes{});
}

Task<Answer<Done>> InsClient::write_inactive(Bytes set) {
  const auto decoded_set = ins::decode_coefficients(set);
  auto bytes = decoded_set ? profile::encode(*profile_, *decoded_set) : tl::unexpected(decoded_set.error());
  if (!bytes) {
    co_return protocol_error(port_, bytes.error());
  }
  if (!profile_->field_by_field) {
    co_return co_await write_record(profile_->slots ? *profile_->set_inactive : *profile_->set_in_force,
                                    std::move(*bytes));
  }
  for (const profile::Field& field : profile_->set.fields) {
    const auto at = bytes->begin() + static_cast<std::ptrdiff_t>(field.at);
    const auto written =
        co_await write_record(*field.did, Bytes(at, at + static_cast<std::ptrdiff_t>(field.end() - field.at)));
    if (!written) {
      co_return written;
    }
  }
  co_return Done{};
}

Task<Answer<Done>> InsClient::commit(Bytes set) {
  if (!profile_->commit.id) {
    co_return Done{};
  }
  const auto decoded_set = ins::decode_coefficients(set);
  const auto bytes = decoded_set ? profile::encode(*profile_, *decoded_set) : tl::unexpected(decoded_set.error());
  if (!bytes) {
    co_return protocol_error(port_, bytes.error());
  }
  co_return co_await command(uds::RoutineAction::start, *profile_->commit.id, profile::commit_start(*profile_, *bytes));
}

Task<Answer<Done>> InsClient::write_schedule(ins::ScheduleRecord schedule) {
  auto bytes = profile::encode(*profile_, schedule);
  if (!bytes) {
    co_return protocol_error(port_, bytes.error());
  }
  co_return co_await write_record(*profile_->schedule.did, std::move(*bytes));
}

Task<Answer<Done>> InsClient::start_rotation(std::uint32_t run_id) {
  co_return co_await command(uds::RoutineAction::start, *profile_->rotate.id,
                             profile::rotation_start(*profile_, run_id));
}

Task<Answer<Done>> InsClient::stop_rotation() {
  co_return co_await command(uds::RoutineAction::stop, *profile_->rotate.id, Bytes{});
}

Task<Answer<ins::RunRecord>> InsClient::rotation_result() {
  const Answer<Bytes> bytes = co_await routine(uds::RoutineAction::result, *profile_->rotate.id, {});
  co_return decoded(port_, *profile_, bytes, profile::decode_run);
}

Task<Answer<Done>> InsClient::start_check(ins::NavigationCheckRequest request) {
  co_return co_await command(uds::RoutineAction::start, *profile_->navigation_check.id,
                             profile::encode(*profile_, request));
}

Task<Answer<Done>> InsClient::stop_check() {
  co_return co_await command(uds::RoutineAction::stop, *profile_->navigation_check.id, Bytes{});
}

Task<Answer<ins::NavigationCheckRecord>> InsClient::check_result() {
  const Answer<Bytes> bytes = co_await routine(uds::RoutineAction::result, *profile_->navigation_check.id, {});
  co_return decoded(port_, *profile_, bytes, profile::decode_navigation_result);
}

Task<Answer<Done>> InsClient::reset() {
  const Answer<Bytes> response = co_await ask(uds::reset_request(uds::ResetType::hard), longest_other);
  if (!response) {
    co_return tl::unexpected(response.error());
  }
  if (const auto well = uds::read_reset_response(*response, uds::ResetType::hard); !well) {
    co_return protocol_error(port_, well.error());
  }
  co_return Done{};
}

}  // namespace selfcal
