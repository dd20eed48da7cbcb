#include "tests/unit/daemon/fake_ins.hpp"

#include <algorithm>

#include "protocol/byte_order.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/security.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"

namespace selfcal::testing_support {

using namespace std::chrono_literals;

FakeIns::FakeIns(Timers& timers) : timers_(timers) {
  slots_[0].author = "factory";
  slots_[1] = slots_[0];
}

FakeIns::~FakeIns() {
  cancel();
  timers_.cancel(status_timer_);
}

void FakeIns::send_status(double schedule_s) {
  schedule_s_ = schedule_s;
  if (on_status && !dead) {
    ins::Status status;
    status.state = state();
    status.moving = moving;
    status.pages_written = pages_written();
    status.time_left_s = state() == ins::State::rotating ? schedule_s_ * (1.0 - since_start() / rotation_s) : 0.0;
    on_status(status);
  }
  status_timer_ = timers_.after(100ms, [this] { send_status(schedule_s_); });
}

double FakeIns::check_elapsed() const {
  return std::min(check_s, std::chrono::duration<double>(timers_.now() - *check_started_).count());
}

double FakeIns::since_start() const { return std::chrono::duration<double>(timers_.now() - started_).count(); }

ins::State FakeIns::state() {
  if (check_started_ && check_elapsed() < check_s) {
    return ins::State::checking;
  }
  if (!turning_) {
    return resting_;
  }
  if (gimbal_sticks && since_start() > rotation_s / 2) {
    return ins::State::failed;
  }
  return since_start() < rotation_s ? ins::State::rotating : ins::State::complete;
}

std::uint32_t FakeIns::pages_written() {
  if (rotation_ == 0) {
    return 0;
  }
  return std::min(pages,
                  static_cast<std::uint32_t>((stopped_s_ < 0 ? since_start() : stopped_s_) / rotation_s * pages));
}

// A move belongs to the position that it leads to.
std::uint8_t FakeIns::position() {
  if (state() != ins::State::rotating) {
    return 0;
  }
  double whole_ms = -static_cast<double>(schedule_.rotation_ms);
  for (const auto& next : schedule_.positions) {
    whole_ms += schedule_.rotation_ms + next.dwell_ms;
  }
  const double elapsed_ms =
      since_start() / rotation_s * whole_ms;  // its schedule takes rotation_s, whatever its length
  double end_ms = -static_cast<double>(schedule_.rotation_ms);
  std::uint8_t position = 0;
  for (const auto& next : schedule_.positions) {
    if (position > 0 && end_ms > elapsed_ms) {
      break;
    }
    ++position;
    end_ms += schedule_.rotation_ms + next.dwell_ms;
  }
  return position;
}

bool FakeIns::session_expired() const { return (dead || !session_kept_) && timers_.now() - alive_at_ > 5s; }

void FakeIns::keep_session(bool keep) {
  if (!dead && session_kept_ && !session_expired()) {
    alive_at_ = timers_.now();
  }
  session_kept_ = keep;
}

Answer<Bytes> FakeIns::change_session(std::uint8_t wanted) {
  unlocked_ = false;
  extended_ = wanted == static_cast<std::uint8_t>(uds::Session::extended);
  return uds::session_response(static_cast<uds::Session>(wanted), {50ms, 5s});
}

void FakeIns::power_cycle() {
  turning_ = unlocked_ = extended_ = false;
  resting_ = ins::State::idle;
  check_started_.reset();
  ++power_cycles_;
  in_force_ = slots_[1].version > slots_[0].version ? 1 : 0;
}

void FakeIns::cancel() { timers_.cancel(timer_); }

void FakeIns::request(std::span<const std::uint8_t> payload, std::size_t, std::function<void(Answer<Bytes>)> done) {
  const Bytes bytes(payload.begin(), payload.end());
  if (dead) {
    timer_ = timers_.after(1s, [done] {
      done(tl::unexpected(PortError{PortError::Kind::link, 0, "fake0: no answer within 1 s"}));
    });
    return;
  }
  if (ignores && ignores(bytes)) {
    alive_at_ = timers_.now();
    timer_ = timers_.after(given_up_after, [done] {
      done(tl::unexpected(PortError{PortError::Kind::link, 0, "fake0: no answer within 1 s"}));
    });
    return;
  }
  timer_ = timers_.after(1ms, [this, bytes, done] {
    if (session_expired()) {
      unlocked_ = extended_ = false;
    }
    alive_at_ = timers_.now();
    auto answer = respond(bytes);
    if (alter) {
      alter(bytes, answer);
    }
    done(std::move(answer));
  });
}

tl::unexpected<PortError> FakeIns::no(std::uint8_t nrc) {
  return tl::unexpected(PortError{PortError::Kind::negative, nrc, "fake0: INS refused: " + uds::describe_nrc(nrc)});
}

Bytes FakeIns::page(std::uint32_t number) {
  flash::Page page;
  page.run_id = rotation_;
  page.sequence = number;
  page.first_sample = std::uint64_t{number} * flash::samples_per_page;
  page.samples.resize(flash::samples_per_page);
  flash::PageBytes bytes;
  flash::encode_page(page, bytes);
  if (bad_pages[number]-- > 0) {
    bytes[100] = static_cast<std::uint8_t>(bytes[100] ^ 1);
  }
  pages_read.push_back(number);
  return {bytes.begin(), bytes.end()};
}

Bytes FakeIns::next_block() {
  if (upload_rest_.empty()) {
    upload_rest_ = page(upload_page_++);
  }
  const auto count = static_cast<std::ptrdiff_t>(std::min<std::size_t>(block_bytes, upload_rest_.size()));
  const Bytes block(upload_rest_.begin(), upload_rest_.begin() + count);
  upload_rest_.erase(upload_rest_.begin(), upload_rest_.begin() + count);
  return block;
}

Answer<Bytes> FakeIns::read(std::uint16_t did) {
  const auto text = [](const std::string& s) { return Bytes(s.begin(), s.end()); };
  const auto set = [](const ins::Coefficients& c) {
    const auto bytes = ins::encode(c);
    return Bytes(bytes.begin(), bytes.end());
  };
  switch (did) {
    case ins::did::serial_number: return text(serial);
    case ins::did::software_version: return text("1.0");
    case ins::did::state: {
      ins::StateRecord record;
      record.state = state();
      record.run_id = rotation_;
      record.coefficients_version = in_force().version;
      record.power_cycles = power_cycles_;
      return ins::encode(record);
    }
    case ins::did::coefficients_in_force: return set(in_force());
    case ins::did::coefficients_inactive: return inactive_.empty() ? set(slots_.at(1 - in_force_)) : inactive_;
    case ins::did::site: return ins::encode(ins::SiteRecord{40, 116, 50});
    case ins::did::sample_format:
      return ins::encode(ins::SampleFormatRecord{told_rate_hz.value_or(sample_rate_hz), 1e-9, 1e-6, 1e-4,
                                                 flash::page_bytes, flash::samples_per_page});
    case ins::did::raw_data_directory:
      return ins::encode(ins::DirectoryRecord{
          rotation_, pages_written() - std::min(pages_written(), ring), pages_written(), pages,
          std::uint64_t{pages_written()} * flash::samples_per_page, state() != ins::State::rotating});
    default: return no(0x31);
  }
}

Answer<Bytes> FakeIns::respond_to_routine(std::span<const std::uint8_t> request) {
  const auto call = uds::parse_routine_request(request);
  if (!call) {
    return no(static_cast<std::uint8_t>(call.error()));
  }
  const bool start = call->action == uds::RoutineAction::start;
  Bytes status;
  switch (call->routine) {
    case ins::routine::self_calibration:
      if (start) {
        if (state() == ins::State::checking) {
          return no(0x22);
        }
        ++starts;
        if (state() == ins::State::rotating) {
          ++second_starts;
        }
        turning_ = true;
        started_ = timers_.now();
        stopped_s_ = -1.0;
        rotation_ = ByteReader(call->option).get<std::uint32_t>();
      } else if (call->action == uds::RoutineAction::result) {
        status = ins::encode(ins::RunRecord{state(), 0, position(), rotation_, pages_written()});
      } else {
        ++stops;
        if (turning_) {
          stopped_s_ = since_start();
        }
        turning_ = false;
        resting_ = ins::State::aborted;
      }
      break;
    case ins::routine::erase_inactive:
      if (state() == ins::State::checking) {
        return no(0x22);
      }
      if (erases) {
        inactive_.assign(ins::coefficients_bytes, 0xFF);
      }
      break;
    case ins::routine::commit_coefficients:
      if (const auto set = ins::decode_coefficients(inactive_); set && !ignores_commit) {
        slots_.at(1 - in_force_) = *set;
      }
      break;
    case ins::routine::navigation_check:
      if (start && state() == ins::State::checking) {
        return no(0x22);
      }
      if (call->action == uds::RoutineAction::stop) {
        if (refuses_check_stop) {
          return no(*refuses_check_stop);
        }
        ++check_stops;
        check_started_.reset();
      }
      if (start) {
        check_started_ = timers_.now();
      }
      if (call->action == uds::RoutineAction::result) {
        const double elapsed = check_started_ ? check_elapsed() : 0.0;
        const double drift = in_force().version == 0 ? 500.0 : 50.0;
        status = ins::encode(ins::NavigationCheckRecord{elapsed >= check_s, elapsed, drift, 0, drift});
      }
      break;
    default: return no(0x31);
  }
  return uds::routine_response(*call, status);
}

Answer<Bytes> FakeIns::respond(std::span<const std::uint8_t> request) {
  if (refuse) {
    return no(*refuse);
  }
  ByteReader reader(request.subspan(1));
  switch (request[0]) {
    case uds::service::session_control: return change_session(request[1]);
    case uds::service::security_access: {
      if (!extended_) {
        return no(0x7F);
      }
      if (reader.get<std::uint8_t>() == uds::security_seed_level) {
        return uds::seed_response(seed_);
      }
      const auto expected = uds::answer_seed(key, seed_);
      if (!std::equal(expected->begin(), expected->end(), request.begin() + 2)) {
        return no(0x35);
      }
      unlocked_ = true;
      return Bytes{0x67, uds::security_key_level};
    }
    case uds::service::read_data: {
      const auto did = reader.get<std::uint16_t>();
      const auto record = read(did);
      if (!record) {
        return tl::unexpected(record.error());
      }
      return uds::read_response(did, *record);
    }
    case uds::service::write_data: {
      const auto did = reader.get<std::uint16_t>();
      if (!unlocked_) {
        return no(0x33);
      }
      if (did == ins::did::schedule) {
        schedule_ = ins::decode_schedule(request.subspan(3)).value();
      }
      if (did == ins::did::coefficients_inactive) {
        inactive_.assign(request.begin() + 3, request.end());
        if (loses_writes) {
          inactive_[60] = static_cast<std::uint8_t>(inactive_[60] ^ 4);
        }
      }
      return uds::write_response(did);
    }
    case uds::service::routine_control: return unlocked_ ? respond_to_routine(request) : no(0x33);
    case uds::service::request_upload: {
      const auto range = uds::parse_upload_request(request);
      if (!unlocked_) {
        return no(0x33);
      }
      if (!range) {
        return no(0x31);
      }
      upload_page_ = range->address;
      upload_rest_.clear();
      return uds::upload_response(flash::page_bytes + uds::transfer_overhead);
    }
    case uds::service::transfer_data: {
      Bytes out;
      uds::transfer_response(request[1], next_block(), out);
      return out;
    }
    case uds::service::transfer_exit: return uds::transfer_exit_response();
    case uds::service::ecu_reset: power_cycle(); return Bytes{0x51, 0x01};
    default: return no(0x11);
  }
}

}  // namespace selfcal::testing_support
