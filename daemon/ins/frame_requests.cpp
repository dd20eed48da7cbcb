// What the service asks, as an INS that speaks UDS would answer it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/ins/frame_port.hpp"
#include "protocol/profile/frame_values.hpp"
#include "protocol/profile/records.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {

using Phase = MoveSequence::Phase;
using profile::FrameState;
using uds::Nrc;

void FramePort::request(std::span<const std::uint8_t> payload, std::size_t, std::function<void(Answer<Bytes>)> done) {
  done_ = std::move(done);
  request_.assign(payload.begin(), payload.end());
  if (!trouble_.empty()) {
    return answer_link(trouble_);
  }
  serve(payload);
}

void FramePort::cancel() {
  done_ = {};
  wait_ = Wait::nothing;
  loop_.cancel(std::exchange(wait_timer_, 0));
  loop_.cancel(std::exchange(answer_timer_, 0));
}

void FramePort::serve(std::span<const std::uint8_t> payload) {
  const auto number = static_cast<std::uint16_t>(payload.size() >= 3 ? payload[1] << 8U | payload[2] : 0);
  switch (payload.front()) {
    case uds::service::session_control: {
      constexpr std::uint8_t p2 = 50, p2_star = 100;  // stated, and of no meaning here
      return positive({0, p2, 0, p2_star});
    }
    case uds::service::ecu_reset: command(frames().reset); return positive({});
    case uds::service::read_data: return read(number);
    case uds::service::write_data: return write(number, payload.subspan(3));
    case uds::service::routine_control: return routine(payload);
    case uds::service::read_memory: return read_memory(payload);
    default: return refuse(Nrc::service_not_supported);
  }
}

void FramePort::read(std::uint16_t did) {
  const profile::Profile& p = *config_.profile;
  if (did == p.serial || did == p.software) {
    return wait_for(did == p.serial ? Wait::serial : Wait::software, "identity frame", config_.request_timeout_s);
  }
  if (did == p.state.did) {
    if (!unsaid_.empty()) {
      return answer(tl::unexpected(trouble(PortError::Kind::protocol, std::exchange(unsaid_, {}))));
    }
    return wait_for(Wait::state, "state frame", config_.request_timeout_s);
  }
  if (did == p.schedule.did && schedule_) {
    return positive(schedule_bytes_);
  }
  if (did == p.directory.did) {
    ins::DirectoryRecord record;
    record.run_id = run_id_;
    record.pages_written = pages_written();
    record.complete = !turning();
    record.pages_expected = sequence_.phase() == Phase::over ? record.pages_written : pages_expected_;
    record.samples =
        record.complete ? stream_.samples() : std::uint64_t{record.pages_written} * flash::samples_per_page;
    return positive(*profile::encode(p, record));
  }
  if (field_of(p, did) != nullptr) {
    command(frames().read, {{"index", did - profile::first_index_did}});
    return wait_for(Wait::told, fmt::format("frame told for index {}", did - profile::first_index_did),
                    config_.request_timeout_s);
  }
  refuse(Nrc::request_out_of_range);
}

void FramePort::write(std::uint16_t did, std::span<const std::uint8_t> record) {
  const profile::Profile& p = *config_.profile;
  if (did == p.schedule.did) {
    // Its bytes are in the INS's words already: they are not turned back.
    const auto schedule = profile::decode_schedule(*profile::built_in(), record);
    if (!schedule) {
      return refuse(Nrc::request_out_of_range);
    }
    schedule_ = *schedule;
    schedule_bytes_.assign(record.begin(), record.end());
    return positive({});
  }
  const profile::Field* field = field_of(p, did);
  if (field == nullptr || record.size() != field->type.bytes) {
    return refuse(Nrc::request_out_of_range);
  }
  const std::uint64_t index = did - profile::first_index_did;
  command(frames().write, {{"index", index}, {"value", bits_of(*field, record)}});
  wait_for(Wait::told, fmt::format("frame told for index {}", index), config_.request_timeout_s);
}

void FramePort::routine(std::span<const std::uint8_t> payload) {
  const auto action = static_cast<uds::RoutineAction>(payload[1]);
  if (action == uds::RoutineAction::start) {
    return start_rotation(payload.subspan(4));
  }
  if (action == uds::RoutineAction::stop) {
    stopped_ = turning();
    sequence_.stop();
    end_stream();
    return positive({});
  }
  ins::RunRecord record;
  record.state = run_state(FrameState::idle);
  record.run_id = run_id_;
  record.position = static_cast<std::uint8_t>(turning() ? sequence_.position() : 0);
  record.pages_written = pages_written();
  positive(*profile::encode(*config_.profile, record));
}

void FramePort::start_rotation(std::span<const std::uint8_t> option) {
  const profile::Profile& p = *config_.profile;
  const auto run_id = profile::read_rotation_start(p, option);
  if (!run_id || !schedule_ || turning()) {
    return refuse(Nrc::conditions_not_correct);
  }
  run_id_ = *run_id;
  stopped_ = false;
  unsaid_.clear();
  stream_.begin();
  stream_.end();
  pages_expected_ = pages_of(*schedule_, p.sample_format.given.at("sample_rate"));
  sequence_.begin(*schedule_, frames().turning);
  command_move();
  if (turning()) {
    wait_for(Wait::first_position, "rest at the first position", frames().turning.longest_move_s);
  }
}

void FramePort::read_memory(std::span<const std::uint8_t> payload) {
  auto told = stream_.memory(payload, pages_written(), run_id_, sequence_.phase() == Phase::over);
  told ? answer(std::move(*told)) : refuse(told.error());
}

}  // namespace selfcal
