#include "protocol/uds/messages.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/byte_order.hpp"

namespace selfcal::uds {
namespace {

constexpr std::uint8_t no_compression = 0x00;
constexpr std::uint8_t read_file_mode = 0x04;

template <typename... Fields>
Bytes message(std::uint8_t service, const Fields&... fields) {
  Bytes bytes(1 + (sizeof(Fields) + ... + 0));
  ByteWriter out(bytes);
  out.put(service);
  (out.put(fields), ...);
  return bytes;
}

Bytes with_tail(Bytes head, ByteView tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

constexpr std::uint8_t positive(std::uint8_t service) { return static_cast<std::uint8_t>(service + positive_offset); }

// Checks that the response starts as it must and has at least `minimum` bytes.
Expected<void> check(ByteView response, std::uint8_t service, ByteView echo, std::size_t minimum) {
  if (response.size() < std::max(minimum, 1 + echo.size())) {
    return fail(ErrorKind::device,
                fmt::format("{}: the response has only {} bytes", service_name(service), response.size()));
  }
  if (response[0] != positive(service)) {
    return fail(ErrorKind::device, fmt::format("{}: the response begins with 0x{:02X} instead of 0x{:02X}",
                                               service_name(service), response[0], positive(service)));
  }
  for (std::size_t i = 0; i < echo.size(); ++i) {
    if (response[1 + i] != echo[i]) {
      return fail(ErrorKind::device, fmt::format("{}: byte {} of the response is 0x{:02X}, the request had 0x{:02X}",
                                                 service_name(service), 1 + i, response[1 + i], echo[i]));
    }
  }
  return {};
}

Expected<void> check_code(ByteView response, std::uint8_t service, std::uint8_t code, std::size_t minimum) {
  return check(response, service, std::span(&code, 1), minimum);
}

Expected<void> check_did(ByteView response, std::uint8_t service, std::uint16_t did) {
  const std::array<std::uint8_t, 2> echo = {static_cast<std::uint8_t>(did >> 8), static_cast<std::uint8_t>(did)};
  return check(response, service, echo, 3);
}

std::uint8_t code(auto value) { return static_cast<std::uint8_t>(value); }

// ISO 14229-1, addressAndLengthFormatIdentifier: bytes of the size in the high nibble, of the address in the low one.
std::uint8_t format_code(UploadFormat format) { return code(format.size_bytes << 4U | format.address_bytes); }
std::uint8_t key_level(std::uint8_t seed_level) { return code(seed_level + 1U); }

Bytes with_range(Bytes request, std::uint32_t address, std::uint32_t bytes, UploadFormat format) {
  for (const auto& [value, count] : {std::pair(address, format.address_bytes), std::pair(bytes, format.size_bytes)}) {
    for (std::size_t i = count; i-- > 0;) {
      request.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
  }
  return request;
}

std::uint64_t number_of(ByteView bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) {
    value = value << 8U | byte;
  }
  return value;
}

// Address and size behind `head` bytes, in a request of just that length.
tl::expected<UploadRange, Nrc> parse_range(ByteView request, std::size_t head, UploadFormat format) {
  if (request.size() != head + format.address_bytes + format.size_bytes) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  return UploadRange{static_cast<std::uint32_t>(number_of(request.subspan(head, format.address_bytes))),
                     static_cast<std::uint32_t>(number_of(request.subspan(head + format.address_bytes)))};
}

}  // namespace

Bytes session_request(Session session) { return message(service::session_control, code(session)); }
Bytes reset_request(ResetType type) { return message(service::ecu_reset, code(type)); }
Bytes tester_present_request(bool suppress_response) {
  return message(service::tester_present, suppress_response ? suppress_response_bit : std::uint8_t{0});
}
Bytes seed_request(std::uint8_t level) { return message(service::security_access, level); }
Bytes key_request(ByteView key, std::uint8_t seed_level) {
  return with_tail(message(service::security_access, key_level(seed_level)), key);
}
Bytes read_request(std::uint16_t did) { return message(service::read_data, did); }
Bytes write_request(std::uint16_t did, ByteView record) { return with_tail(message(service::write_data, did), record); }
Bytes routine_request(RoutineAction action, std::uint16_t routine, ByteView option) {
  return with_tail(message(service::routine_control, code(action), routine), option);
}
Bytes upload_request(std::uint32_t address, std::uint32_t bytes, UploadFormat format) {
  return with_range(message(service::request_upload, no_compression, format_code(format)), address, bytes, format);
}
Bytes memory_request(std::uint32_t address, std::uint32_t bytes, UploadFormat format) {
  return with_range(message(service::read_memory, format_code(format)), address, bytes, format);
}
Bytes write_memory_request(std::uint32_t address, ByteView data, UploadFormat format) {
  return with_tail(with_range(message(service::write_memory, format_code(format)), address,
                              static_cast<std::uint32_t>(data.size()), format),
                   data);
}
Bytes file_request(std::string_view name) {
  Bytes tail(name.begin(), name.end());
  tail.push_back(no_compression);
  return with_tail(message(service::file_transfer, read_file_mode, static_cast<std::uint16_t>(name.size())), tail);
}
Bytes transfer_request(std::uint8_t block) { return message(service::transfer_data, block); }
Bytes transfer_exit_request() { return message(service::transfer_exit); }

Expected<SessionTimings> read_session_response(ByteView response, Session session) {
  return check_code(response, service::session_control, code(session), 6).map([&] {
    ByteReader in(response.subspan(2));
    const Time p2 = std::chrono::milliseconds(in.get<std::uint16_t>());
    return SessionTimings{p2, std::chrono::milliseconds(10 * in.get<std::uint16_t>())};
  });
}

Expected<void> read_reset_response(ByteView response, ResetType type) {
  return check_code(response, service::ecu_reset, code(type), 2);
}

Expected<Bytes> read_seed_response(ByteView response, std::uint8_t level, std::size_t length) {
  return check_code(response, service::security_access, level, 2 + length).map([&] {
    const ByteView seed = response.subspan(2, length);
    return Bytes(seed.begin(), seed.end());
  });
}

Expected<void> read_key_response(ByteView response, std::uint8_t seed_level) {
  return check_code(response, service::security_access, key_level(seed_level), 2);
}

Expected<ByteView> read_read_response(ByteView response, std::uint16_t did) {
  return check_did(response, service::read_data, did).map([&] { return response.subspan(3); });
}

Expected<void> read_write_response(ByteView response, std::uint16_t did) {
  return check_did(response, service::write_data, did);
}

Expected<ByteView> read_routine_response(ByteView response, RoutineAction action, std::uint16_t routine) {
  const std::array<std::uint8_t, 3> echo = {code(action), code(routine >> 8), code(routine)};
  return check(response, service::routine_control, echo, 4).map([&] { return response.subspan(4); });
}

Expected<std::uint32_t> read_upload_response(ByteView response) {
  if (const auto checked = check(response, service::request_upload, {}, 3); !checked) {
    return tl::unexpected(checked.error());
  }
  const std::size_t width = response[1] >> 4U;
  if (width < 1 || width > 4 || response.size() < 2 + width) {
    return fail(ErrorKind::device, fmt::format("RequestUpload: length format 0x{:02X} in a response of {} bytes",
                                               response[1], response.size()));
  }
  const auto longest = static_cast<std::uint32_t>(number_of(response.subspan(2, width)));
  if (longest <= transfer_overhead) {
    return fail(ErrorKind::device, fmt::format("RequestUpload: blocks of {} bytes carry no data", longest));
  }
  return longest;
}

Expected<ByteView> read_memory_response(ByteView response, std::uint32_t bytes) {
  if (const auto checked = check(response, service::read_memory, {}, 2); !checked) {
    return tl::unexpected(checked.error());
  }
  if (response.size() != 1 + std::size_t{bytes}) {
    return fail(ErrorKind::device,
                fmt::format("ReadMemoryByAddress: {} bytes in answer to a request for {}", response.size() - 1, bytes));
  }
  return response.subspan(1);
}

Expected<void> read_write_memory_response(ByteView response, std::uint32_t address, std::uint32_t bytes,
                                          UploadFormat format) {
  const Bytes echo = with_range(message(format_code(format)), address, bytes, format);
  if (const auto checked = check(response, service::write_memory, echo, 1 + echo.size()); !checked) {
    return checked;
  }
  if (response.size() != 1 + echo.size()) {
    return fail(ErrorKind::device, fmt::format("WriteMemoryByAddress: a response of {} bytes, {} expected",
                                               response.size(), 1 + echo.size()));
  }
  return {};
}

Expected<ByteView> read_transfer_response(ByteView response, std::uint8_t block) {
  return check_code(response, service::transfer_data, block, 2).map([&] { return response.subspan(2); });
}

Expected<ByteView> read_transfer_exit_response(ByteView response) {
  return check(response, service::transfer_exit, {}, 1).map([&] { return response.subspan(1); });
}

// ISO 14229-1, 10.8: length, format, total length.
tl::expected<MemoryWrite, Nrc> parse_write_memory_request(ByteView request, UploadFormat format) {
  constexpr std::size_t shortest = 5;  // service, format, one byte each of address, length and data
  if (request.size() < shortest) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (request[1] != format_code(format)) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  const std::size_t head = 2 + format.address_bytes + format.size_bytes;
  if (request.size() < head) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  const auto range = parse_range(request.first(head), 2, format);
  if (request.size() != head + std::size_t{range->bytes}) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  return MemoryWrite{*range, request.subspan(head)};
}

tl::expected<UploadRange, Nrc> parse_memory_request(ByteView request, UploadFormat format) {
  constexpr std::size_t shortest = 4;  // service, format, one byte each of address and length
  if (request.size() < shortest) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  return request[1] == format_code(format) ? parse_range(request, 2, format)
                                           : tl::unexpected(Nrc::request_out_of_range);
}

// ISO 14229-1, 14.6: mode, bytes of the longest block and the block, data format, bytes of a size, size, size compressed.
Expected<FileAnswer> read_file_response(ByteView response) {
  if (const auto checked = check_code(response, service::file_transfer, read_file_mode, 3); !checked) {
    return tl::unexpected(checked.error());
  }
  const auto malformed = [&](std::string_view what) {
    return fail(ErrorKind::device,
                fmt::format("RequestFileTransfer: {} in a response of {} bytes", what, response.size()));
  };
  const std::size_t width = response[2];
  constexpr std::size_t size_width_bytes = 2;
  const std::size_t format_at = 3 + width, sizes_at = format_at + 1 + size_width_bytes;
  if (width < 1 || width > 4 || response.size() < sizes_at) {
    return malformed(fmt::format("a block's length of {} bytes", width));
  }
  const std::uint64_t size_width = number_of(response.subspan(format_at + 1, size_width_bytes));
  if (size_width < 1 || size_width > 8 || response.size() != sizes_at + 2 * size_width) {
    return malformed(fmt::format("a file's size of {} bytes", size_width));
  }
  const FileAnswer answer{static_cast<std::uint32_t>(number_of(response.subspan(3, width))),
                          number_of(response.subspan(sizes_at, size_width))};
  if (response[format_at] != no_compression || number_of(response.subspan(sizes_at + size_width)) != answer.bytes) {
    return malformed("compressed or encrypted data");
  }
  return answer.longest > transfer_overhead ? Expected<FileAnswer>(answer) : malformed("blocks without data");
}

tl::expected<std::string, Nrc> parse_file_request(ByteView request) {
  constexpr std::size_t head = 4, shortest = 6;  // service, mode, two bytes of length; a name and the data format
  if (request.size() < shortest) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (request[1] != read_file_mode) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  const std::uint64_t length = number_of(request.subspan(2, 2));
  if (request.size() != head + length + 1) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (request.back() != no_compression) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  return std::string(request.begin() + head, request.end() - 1);
}

tl::expected<UploadRange, Nrc> parse_upload_request(ByteView request, UploadFormat format) {
  constexpr std::size_t shortest = 5;  // service, two formats, one byte each of address and length
  if (request.size() < shortest) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  if (request[1] != no_compression || request[2] != format_code(format)) {
    return tl::unexpected(Nrc::request_out_of_range);
  }
  return parse_range(request, 3, format);
}

tl::expected<RoutineCall, Nrc> parse_routine_request(ByteView request) {
  if (request.size() < 2) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  ByteReader in(request.subspan(1));
  const auto action = in.get<std::uint8_t>();
  if (action < code(RoutineAction::start) || action > code(RoutineAction::result)) {
    return tl::unexpected(Nrc::sub_function_not_supported);
  }
  if (request.size() < 4) {
    return tl::unexpected(Nrc::incorrect_message_length);
  }
  return RoutineCall{static_cast<RoutineAction>(action), in.get<std::uint16_t>(), request.subspan(4)};
}

std::array<std::uint8_t, 3> negative_response(std::uint8_t service, Nrc nrc) {
  return {service::negative_response, service, code(nrc)};
}

Bytes session_response(Session session, const SessionTimings& timings) {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  return message(positive(service::session_control), code(session),
                 static_cast<std::uint16_t>(duration_cast<milliseconds>(timings.p2).count()),
                 static_cast<std::uint16_t>(duration_cast<milliseconds>(timings.p2_star).count() / 10));
}
Bytes seed_response(ByteView seed, std::uint8_t level) {
  return with_tail(message(positive(service::security_access), level), seed);
}
Bytes read_response(std::uint16_t did, ByteView record) {
  return with_tail(message(positive(service::read_data), did), record);
}
Bytes write_response(std::uint16_t did) { return message(positive(service::write_data), did); }
Bytes routine_response(const RoutineCall& call, ByteView status) {
  return with_tail(message(positive(service::routine_control), code(call.action), call.routine), status);
}
Bytes upload_response(std::uint32_t max_block) {
  return message(positive(service::request_upload), std::uint8_t{0x40}, max_block);
}
Bytes file_response(std::uint32_t max_block, std::uint32_t file_bytes) {
  constexpr std::uint16_t size_width = sizeof file_bytes;
  return message(positive(service::file_transfer), read_file_mode, static_cast<std::uint8_t>(sizeof max_block),
                 max_block, no_compression, size_width, file_bytes, file_bytes);
}
void transfer_response(std::uint8_t block, ByteView data, Bytes& out) {
  out.assign({positive(service::transfer_data), block});
  out.insert(out.end(), data.begin(), data.end());
}
Bytes memory_response(ByteView data) { return with_tail(message(positive(service::read_memory)), data); }
Bytes write_memory_response(const UploadRange& range, UploadFormat format) {
  return with_range(message(positive(service::write_memory), format_code(format)), range.address, range.bytes, format);
}
Bytes transfer_exit_response(ByteView parameters) {
  return with_tail(message(positive(service::transfer_exit)), parameters);
}

}  // namespace selfcal::uds
