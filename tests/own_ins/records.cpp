#include "tests/own_ins/records.hpp"

#include <fmt/format.h>

#include "protocol/byte_order.hpp"

namespace selfcal::ins {
namespace {

template <typename... Fields>
Bytes pack(const Fields&... fields) {
  Bytes bytes((sizeof(Fields) + ...));
  ByteWriter out(bytes);
  (out.put(fields), ...);
  return bytes;
}

tl::unexpected<Error> wrong(std::string_view record, std::string_view field, const auto& value) {
  return fail(ErrorKind::bad_input, fmt::format("{} record: {} is {}", record, field, value));
}

Expected<void> check_length(std::string_view record, ByteView bytes, std::size_t wanted) {
  if (bytes.size() != wanted) {
    return fail(ErrorKind::bad_input, fmt::format("{} record: {} bytes instead of {}", record, bytes.size(), wanted));
  }
  return {};
}

template <typename E>
std::uint8_t code(E value) {
  return static_cast<std::uint8_t>(value);
}
bool is_state(std::uint8_t value) { return value <= code(State::checking); }
bool is_slot(std::uint8_t value) { return value <= code(Slot::b); }

template <typename R>
Expected<R> checked(const R& record) {
  const auto well = check(record);
  return well ? Expected<R>(record) : tl::unexpected(well.error());
}

}  // namespace

Bytes encode(const StateRecord& r) {
  return pack(code(r.state), r.faults, code(r.in_force), r.coefficients_version, r.coefficients_crc, r.run_id,
              r.power_cycles);
}

Expected<StateRecord> decode_state(ByteView bytes) {
  if (const auto length = check_length("state", bytes, 19); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  StateRecord r;
  const auto state = in.get<std::uint8_t>();
  r.faults = in.get<std::uint8_t>();
  const auto slot = in.get<std::uint8_t>();
  if (!is_state(state)) {
    return wrong("state", "state", state);
  }
  if (!is_slot(slot)) {
    return wrong("state", "slot in force", slot);
  }
  r.state = static_cast<State>(state);
  r.in_force = static_cast<Slot>(slot);
  r.coefficients_version = in.get<std::uint32_t>();
  r.coefficients_crc = in.get<std::uint32_t>();
  r.run_id = in.get<std::uint32_t>();
  r.power_cycles = in.get<std::uint32_t>();
  return r;
}

Bytes encode(const ScheduleRecord& r) {
  Bytes bytes(5 + 12 * r.positions.size());
  ByteWriter out(bytes);
  out.put(static_cast<std::uint8_t>(r.positions.size()));
  out.put(r.rotation_ms);
  for (const auto& position : r.positions) {
    out.put(position.outer_mdeg);
    out.put(position.inner_mdeg);
    out.put(position.dwell_ms);
  }
  return bytes;
}

Expected<ScheduleRecord> decode_schedule(ByteView bytes) {
  ByteReader in(bytes);
  const auto count = in.get<std::uint8_t>();
  ScheduleRecord r;
  r.rotation_ms = in.get<std::uint32_t>();
  if (count == 0) {
    return wrong("schedule", "number of positions", count);
  }
  if (const auto length = check_length("schedule", bytes, std::size_t{5} + 12 * std::size_t{count}); !length) {
    return tl::unexpected(length.error());
  }
  for (unsigned i = 0; i < count; ++i) {
    ScheduleRecord::Position position;
    position.outer_mdeg = in.get<std::int32_t>();
    position.inner_mdeg = in.get<std::int32_t>();
    position.dwell_ms = in.get<std::uint32_t>();
    r.positions.push_back(position);
  }
  return checked(r);
}

Bytes encode(const DirectoryRecord& r) {
  return pack(r.run_id, r.first_page, r.pages_written, r.pages_expected, r.samples,
              static_cast<std::uint8_t>(r.complete ? 1 : 0));
}

Expected<DirectoryRecord> decode_directory(ByteView bytes) {
  if (const auto length = check_length("directory", bytes, 25); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  DirectoryRecord r;
  r.run_id = in.get<std::uint32_t>();
  r.first_page = in.get<std::uint32_t>();
  r.pages_written = in.get<std::uint32_t>();
  r.pages_expected = in.get<std::uint32_t>();
  r.samples = in.get<std::uint64_t>();
  const auto complete = in.get<std::uint8_t>();
  if (complete > 1) {
    return wrong("directory", "completeness", complete);
  }
  r.complete = complete == 1;
  return checked(r);
}

Bytes encode(const RunRecord& r) { return pack(code(r.state), r.faults, r.position, r.run_id, r.pages_written); }

Expected<RunRecord> decode_run(ByteView bytes) {
  if (const auto length = check_length("run", bytes, 11); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  RunRecord r;
  const auto state = in.get<std::uint8_t>();
  if (!is_state(state)) {
    return wrong("run", "state", state);
  }
  r.state = static_cast<State>(state);
  r.faults = in.get<std::uint8_t>();
  r.position = in.get<std::uint8_t>();
  r.run_id = in.get<std::uint32_t>();
  r.pages_written = in.get<std::uint32_t>();
  return r;
}

Bytes encode(const NavigationCheckRequest& r) { return pack(r.duration_s, code(r.compensation)); }

Expected<NavigationCheckRequest> decode_navigation_request(ByteView bytes) {
  if (const auto length = check_length("navigation check request", bytes, 5); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  NavigationCheckRequest r;
  r.duration_s = in.get<std::uint32_t>();
  const auto slot = in.get<std::uint8_t>();
  if (!is_slot(slot)) {
    return wrong("navigation check request", "compensation", slot);
  }
  r.compensation = static_cast<Slot>(slot);
  return r;
}

Bytes encode(const NavigationCheckRecord& r) {
  return pack(static_cast<std::uint8_t>(r.done ? 1 : 0), r.elapsed_s, r.north_m, r.east_m, r.max_horizontal_m);
}

Expected<NavigationCheckRecord> decode_navigation_result(ByteView bytes) {
  if (const auto length = check_length("navigation check", bytes, 33); !length) {
    return tl::unexpected(length.error());
  }
  ByteReader in(bytes);
  NavigationCheckRecord r;
  const auto done = in.get<std::uint8_t>();
  if (done > 1) {
    return wrong("navigation check", "completeness", done);
  }
  r.done = done == 1;
  for (double* value : {&r.elapsed_s, &r.north_m, &r.east_m, &r.max_horizontal_m}) {
    *value = in.get_double();
  }
  return checked(r);
}

}  // namespace selfcal::ins
