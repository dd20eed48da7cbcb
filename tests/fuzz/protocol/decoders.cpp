// Every decoder of bytes that a peer wrote. The first byte of the input chooses; what decodes must encode to the same.
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "protocol/can/bus_event.hpp"
#include "protocol/can/bus_log.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/ins_interface/status.hpp"
#include "protocol/isotp/codec.hpp"
#include "protocol/lcm/decode.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/profile/status_frames.hpp"
#include "protocol/uds/client.hpp"
#include "protocol/uds/decode.hpp"
#include "protocol/uds/messages.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/own_ins/status_frames.hpp"

using namespace selfcal;

namespace {

using Bytes = std::span<const std::uint8_t>;

void must(bool holds) {
  if (!holds) {
    std::abort();
  }
}

template <typename Decoded>
void must_encode_to(const Decoded& decoded, Bytes bytes) {
  must(!decoded || std::ranges::equal(ins::encode(*decoded), bytes));
}

std::string_view text_of(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

// Per frame: one byte for pause and identifier, one for the length, then the frame. False at the end.
bool next_frame(Bytes& bytes, can::CanFrame& frame, Time& now) {
  if (bytes.size() < 2) {
    return false;
  }
  constexpr std::array<std::uint32_t, 6> ids{0x640, 0x648, 0x7DF, 0x650, 0x651, 0x123};
  now += std::chrono::milliseconds(bytes[0] / 8 * 40);
  frame = {};
  frame.id = ids[bytes[0] % 8U % ids.size()];
  frame.fd = (bytes[1] & 0x80U) != 0;
  const std::size_t wanted =
      std::min<std::size_t>(bytes[1] & 0x7FU, frame.fd ? can::max_fd_bytes : can::max_classic_bytes);
  frame.size = static_cast<std::uint8_t>(std::min(wanted, bytes.size() - 2));
  std::copy_n(bytes.begin() + 2, frame.size, frame.data.begin());
  bytes = bytes.subspan(2U + frame.size);
  return true;
}

void decode_record(std::uint8_t which, Bytes bytes) {
  switch (which % 16) {
    case 0: return must_encode_to(ins::decode_state(bytes), bytes);
    case 1: return must_encode_to(ins::decode_schedule(bytes), bytes);
    case 2: return must_encode_to(ins::decode_site(bytes), bytes);
    case 3: return must_encode_to(ins::decode_directory(bytes), bytes);
    case 4: return must_encode_to(ins::decode_sample_format(bytes), bytes);
    case 5: return must_encode_to(ins::decode_run(bytes), bytes);
    case 6: return must_encode_to(ins::decode_navigation_request(bytes), bytes);
    case 7: static_cast<void>(ins::decode_coefficients(bytes)); return;
    default: return must_encode_to(ins::decode_navigation_result(bytes), bytes);
  }
}

// What a positive answer of a hostile INS says, with the identifiers that the daemon asks for.
void read_responses(Bytes bytes) {
  static_cast<void>(uds::read_session_response(bytes, uds::Session::extended));
  static_cast<void>(uds::read_reset_response(bytes, uds::ResetType::hard));
  static_cast<void>(uds::read_seed_response(bytes));
  static_cast<void>(uds::read_key_response(bytes));
  const auto did = static_cast<std::uint16_t>(bytes.size() < 3 ? 0 : bytes[1] << 8U | bytes[2]);
  if (const auto record = uds::read_read_response(bytes, did)) {
    must(std::ranges::equal(uds::read_response(did, *record), bytes));
  }
  static_cast<void>(uds::read_write_response(bytes, did));
  const auto routine = static_cast<std::uint16_t>(bytes.size() < 4 ? 0 : bytes[2] << 8U | bytes[3]);
  static_cast<void>(uds::read_routine_response(bytes, uds::RoutineAction::start, routine));
  static_cast<void>(uds::read_upload_response(bytes));
  static_cast<void>(uds::read_transfer_response(bytes, bytes.size() < 2 ? 0 : bytes[1]));
  static_cast<void>(uds::read_transfer_exit_response(bytes));
  static_cast<void>(uds::parse_upload_request(bytes));
  static_cast<void>(uds::parse_routine_request(bytes));
  if (const auto file = uds::read_file_response(bytes)) {
    must(file->longest > uds::transfer_overhead);
  }
  if (const auto name = uds::parse_file_request(bytes)) {
    must(std::ranges::equal(uds::file_request(*name), bytes));
  }
}

// What a line says is what it says when it is written and read again.
void read_log(Bytes bytes) {
  std::istringstream in{std::string(text_of(bytes))};
  can::LogReader reader(in);
  for (auto entry = reader.next(); entry && *entry; entry = reader.next()) {
    const can::LogEntry& read = **entry;
    std::array<char, can::max_log_line> line{};
    const auto again =
        can::parse_log_line(can::format_log_line(read.time, read.interface, read.frame, read.error_frame, line));
    must(again && again->time == read.time && again->interface == read.interface && again->frame == read.frame &&
         again->error_frame == read.error_frame);
  }
}

void listen(Bytes bytes) {
  uds::LogDecoder decoder(profile::decoder_options(profile::built_in()));
  ins::Status status, by_profile;
  can::CanFrame frame;
  Time now{0};
  while (next_frame(bytes, frame, now)) {
    if (const auto entry = decoder.on_frame(frame, now)) {
      must(uds::line(*entry).find('\n') == std::string::npos);
    }
    static_cast<void>(can::decode_error_frame(frame.id, frame.payload()));
    if (ins::apply_status_frame(frame, status)) {
      const bool of_gimbal = frame.id == ins::can_id::gimbal;
      const auto encode = of_gimbal ? ins::encode_gimbal_frame : ins::encode_state_frame;
      ins::Status again;
      const can::CanFrame written = encode(status, 7, frame.id);
      must(ins::apply_status_frame(written, again) && encode(again, 7, frame.id) == written);
    }
    // By our own profile the same is taken of the same frames.
    ins::Status before = by_profile;
    const bool ours = profile::apply_status(*profile::built_in(), frame, ins::can_id::status, false, by_profile);
    ins::Status by_table = before;
    must(ours == ins::apply_status_frame(frame, by_table));
    const auto told = [](const ins::Status& taken) {
      return std::array{ins::encode_state_frame(taken, 0, 1), ins::encode_gimbal_frame(taken, 0, 2)};
    };
    must(told(by_profile) == told(by_table));
  }
}

// The client of a hostile INS: an outcome for every request, the frames it wants to send within bounds.
void ask(Bytes bytes) {
  isotp::Options options;
  options.address = {0x640, 0x648, 0x7DF, false};
  options.fd = true;
  uds::Client client(options, {});
  client.keep_session(true, Time{0});
  const auto request = uds::read_request(ins::did::serial_number);
  std::vector<can::CanFrame> out(16);
  can::CanFrame frame;
  Time now{0};
  const auto judge = [](const std::optional<uds::Outcome>& outcome) {
    // It answers what was asked, as far as it goes; read_read_response() refuses one that is too short.
    constexpr std::array<std::uint8_t, 3> answer{0x62, 0xF1, 0x8C};
    if (outcome && outcome->kind == uds::Outcome::Kind::positive) {
      const std::size_t size = std::min(outcome->response.size(), answer.size());
      must(size > 0 && std::equal(answer.begin(), answer.begin() + size, outcome->response.begin()));
      must(size == answer.size() || !uds::read_read_response(outcome->response, ins::did::serial_number));
    }
  };
  while (next_frame(bytes, frame, now)) {
    judge(client.on_time(now));
    if (!client.busy()) {
      static_cast<void>(client.request(request, now));
    }
    judge(client.sent(client.pending(out, now), now));
    judge(client.on_frame(frame, now));
  }
  for (int k = 0; client.busy(); ++k) {  // nobody answers any more: P2, P2* and the limit of response-pending pass
    must(k < 1000);
    now += std::chrono::seconds(1);
    judge(client.on_time(now));
    judge(client.sent(client.pending(out, now), now));
  }
}

template <typename Message>
void decode_message(Bytes bytes) {
  if (const auto message = lcm_messages::decode<Message>(bytes)) {
    std::vector<std::uint8_t> again(static_cast<std::size_t>(message->getEncodedSize()));
    // lcm-gen counts a text by its size and writes it up to its first NUL.
    const int written = message->encode(again.data(), 0, static_cast<int>(again.size()));
    must(written > 0 && written <= static_cast<int>(again.size()));
    again.resize(static_cast<std::size_t>(written));
    must(lcm_messages::decode<Message>(again).has_value());
  }
}

void decode_other(std::uint8_t which, Bytes bytes) {
  flash::Page page;
  switch (which % 16) {
    case 0: static_cast<void>(isotp::decode(bytes.first(std::min<std::size_t>(bytes.size(), 64)))); return;
    case 1: static_cast<void>(flash::decode_page(bytes, page)); return;
    case 2: static_cast<void>(uds::describe_message(bytes)); return;
    case 3: static_cast<void>(can::parse_log_line(text_of(bytes))); return;
    case 4: return read_responses(bytes);
    case 5: return read_log(bytes);
    case 6: return listen(bytes);
    case 7: return ask(bytes);
    case 8: return decode_message<selfcal_lcm::service_status>(bytes);
    case 9: return decode_message<selfcal_lcm::ins_status>(bytes);
    case 10: return decode_message<selfcal_lcm::estimate>(bytes);
    default: return decode_message<selfcal_lcm::alarm>(bytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) {
    const std::span<const std::uint8_t> bytes(data + 1, size - 1);
    (data[0] & 0x80U) != 0 ? decode_other(data[0] & 0x7FU, bytes) : decode_record(data[0], bytes);
  }
  return 0;
}
