// WriteDataByIdentifier and WriteMemoryByAddress, the slots, and ECUReset: what changes something. No set is put in force.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"
#include "tools/cli/device/record_access.hpp"
#include "tools/cli/device/unused_number.hpp"

namespace selfcal::cli::device {
namespace {

using uds::Nrc;
using uds::RoutineAction;
constexpr std::string_view writing = "ISO 14229-1, 10.7", writing_memory = "ISO 14229-1, 10.8",
                           routines = "ISO 14229-1, 13.2", reset = "ISO 14229-1, 9.3";

std::string_view clause_of_writing(const profile::Profile& p, std::uint16_t did) {
  return in_memory(p, did) ? writing_memory : writing;
}

Bytes without_last(Bytes request) {
  request.pop_back();
  return request;
}

// The schedule that the INS has; where it has none, one move there and back, which is never begun.
Bytes schedule_of(Conformance& c) {
  const profile::Profile& p = c.profile();
  if (const RecordExchange told = read_record(c, *p.schedule.did); told.record) {
    return *told.record;
  }
  ins::ScheduleRecord schedule;
  schedule.rotation_ms = 10000;
  schedule.positions = {{0, 0, 60000}, {90000, 0, 60000}, {0, 0, 60000}};
  return profile::encode(p, schedule).value_or(Bytes{});
}

// Written, and read back.
void try_write(Conformance& c, const Requirement& requirement, std::uint16_t did, ByteView record) {
  if (!c.ready(requirement)) {
    return;
  }
  const RecordExchange written = write_record(c, did, record);
  const RecordExchange told = read_record(c, did);
  const bool same = told.record && std::ranges::equal(*told.record, record);
  c.judged(requirement, fmt::format("{}, then {}", written.sent, told.sent),
           "a positive response, then the record as it was written",
           !written.record ? came(written, written.record.error().message)
           : same          ? "the record as it was written"
                           : words(told.exchange),
           written.record && same);
}

// What is refused whatever is written.
void try_refusals_of_writing(Conformance& c, const Bytes& request) {
  const profile::Profile& p = c.profile();
  const bool by_address = request[0] == uds::service::write_memory;
  const std::string_view clause = by_address ? writing_memory : writing;
  if (p.security.needed) {
    c.refused({"write.locked", clause, "While the lock is closed nothing is written.", Mode::session, true}, request,
              {Nrc::security_access_denied});
  }
  c.refused({"write.session", "ISO 14229-1, 7.5", "In the default session nothing is written.", Mode::standard, true},
            request, {Nrc::service_not_supported_in_session});
  c.refused({"write.too_short", clause, "A record that is too short is refused.", Mode::open, true},
            without_last(request), {Nrc::incorrect_message_length});
  if (request[0] == uds::service::write_data) {
    c.refused({"write.unknown", clause, "An identifier that is none is not written.", Mode::open, true},
              uds::write_request(unused_did, Bytes{0}), {Nrc::request_out_of_range});
  }
  if (by_address == in_memory(p, *p.state.did)) {
    c.refused({"write.read_only", clause, "A record that is only read is not written.", Mode::open, true},
              write_request_of(p, *p.state.did, Bytes(p.state.layout.bytes, 0)), {Nrc::request_out_of_range});
  }
}

void try_schedule(Conformance& c) {
  const profile::Profile& p = c.profile();
  if (!p.schedule.did || !c.permission().write) {
    return c.not_tried({"write.schedule", writing, "The schedule is written."}, "needs --write");
  }
  const Bytes schedule = schedule_of(c);
  try_refusals_of_writing(c, write_request_of(p, *p.schedule.did, schedule));
  try_write(c,
            {"write.schedule", clause_of_writing(p, *p.schedule.did),
             "The schedule is written, and read back as written.", Mode::open, true},
            *p.schedule.did, schedule);
}

// A move that is none: to where the gimbal stands.
std::optional<ins::MoveRecord> standing(Conformance& c) {
  const profile::Profile& p = c.profile();
  const bool tells = p.state.layout.find("outer") != nullptr && p.state.layout.find("inner") != nullptr;
  const RecordExchange told = read_record(c, *p.state.did);
  const auto state = told.record && tells ? profile::decode_state(p, *told.record) : tl::unexpected(Error{});
  if (!state) {
    return std::nullopt;
  }
  const auto mdeg = [](double degrees) { return static_cast<std::int32_t>(std::lround(degrees * 1e3)); };
  return ins::MoveRecord{mdeg(state->outer_deg), mdeg(state->inner_deg)};
}

// The gimbal is not turned: what is refused, and what is commanded where it stands already.
void try_move(Conformance& c) {
  const profile::Profile& p = c.profile();
  constexpr Requirement taken{"move.taken", "profile, move", "A move to where the gimbal stands is taken.", Mode::open,
                              true};
  if (!c.permission().write) {
    return c.not_tried(taken, "needs --write");
  }
  const auto here = standing(c);
  const Bytes record = profile::encode(p, here.value_or(ins::MoveRecord{})).value_or(Bytes(p.move->layout.bytes, 0));
  const Bytes request = p.move->did ? write_request_of(p, *p.move->did, record)
                                    : uds::routine_request(RoutineAction::start, *p.move->routine, record);
  try_refusals_of_writing(c, request);
  if (!here) {
    return c.not_tried(taken, "where it stands is not told");
  }
  if (!p.move->did) {
    c.answered(taken, request, 3);
  } else if (c.ready(taken)) {
    const RecordExchange written = write_record(c, *p.move->did, record);
    c.judged(taken, written.sent, "a positive response",
             came(written, written.record ? "" : written.record.error().message), written.record.has_value());
  }
}

bool erased(Conformance& c) {
  const RecordExchange told = read_record(c, *c.profile().set_inactive);
  return told.exchange.kind == Exchange::Kind::negative ||
         (told.record && std::ranges::all_of(*told.record, [](std::uint8_t byte) { return byte == 0xFF; }));
}

void try_erase(Conformance& c, const Requirement& requirement) {
  if (!c.ready(requirement)) {
    return;
  }
  const Bytes request = uds::routine_request(RoutineAction::start, *c.profile().erase.id);
  const Exchange exchange = c.tester().ask(request);
  const bool blank = exchange.kind == Exchange::Kind::positive && erased(c);
  c.judged(requirement, hex(request) + ", then the inactive set is read", "71 01, then 0x22 or all FF",
           exchange.kind != Exchange::Kind::positive ? words(exchange)
           : blank                                   ? "erased"
                                                     : "a set is still told",
           blank);
}

// Of an INS without slots: what is there already, or of a set that is told field by field its first field.
void try_writing_over(Conformance& c) {
  const profile::Profile& p = c.profile();
  const std::uint16_t did = p.field_by_field ? p.set.fields.front().did.value_or(0) : p.set_in_force.value_or(0);
  const std::string_view clause = clause_of_writing(p, did);
  const Requirement written{"set.write_over", clause, "What is there is written again, and read back as written.",
                            Mode::open, true};
  const RecordExchange told = read_record(c, did);
  if (!told.record) {
    return c.not_tried(written, fmt::format("it cannot be read: {}", words(told.exchange)));
  }
  const Bytes held = *told.record;
  c.refused({"set.too_short", clause, "A record of coefficients that is too short is refused.", Mode::open, true},
            without_last(write_request_of(p, did, held)), {Nrc::incorrect_message_length});
  try_write(c, written, did, held);
}

// A set that is the one in force, in the inactive slot; erased afterwards.
void try_set(Conformance& c) {
  const profile::Profile& p = c.profile();
  const auto record = p.set_in_force ? read_record(c, *p.set_in_force).record : tl::unexpected(Error{});
  const std::string_view clause = p.set_inactive ? clause_of_writing(p, *p.set_inactive) : writing;
  const Requirement written{"set.write", clause, "A set is written into the inactive slot, and read back as written.",
                            Mode::open, true};
  if (!record || !p.set_inactive || !c.permission().write) {
    return c.not_tried(written, c.permission().write ? "no set in force can be read" : "needs --write");
  }
  // What an INS tells has any length: a set is only spoilt and written where it is a whole one.
  if (!profile::length_fits(p.set, *record)) {
    return c.not_tried(written,
                       fmt::format("the set in force has {} bytes, the profile says {}", record->size(), p.set.bytes));
  }
  const Bytes set(record->begin(), record->end());
  if (p.erase.id) {
    try_erase(c, {"set.erase", routines, "The inactive slot is erased.", Mode::open, true});
  }
  c.refused({"set.too_short", clause, "A set that is too short is refused.", Mode::open, true},
            without_last(write_request_of(p, *p.set_inactive, set)), {Nrc::incorrect_message_length});
  const bool judged = !in_memory(p, *p.set_inactive);  // what is written into memory the INS need not look at
  if (p.set.checksum && judged) {
    Bytes spoilt = set;
    spoilt[p.set.checksum->field.at] ^= 0x01U;
    c.refused(
        {"set.checksum", "profile, coefficients.checksum", "A set with a wrong checksum is refused.", Mode::open, true},
        uds::write_request(*p.set_inactive, spoilt), {Nrc::request_out_of_range});
  }
  try_write(c, written, *p.set_inactive, set);
  if (p.commit.id && p.set.checksum && !p.commit.start.fields.empty()) {
    Bytes spoilt = set;
    spoilt[p.set.checksum->field.at] ^= 0x01U;
    c.refused(
        {"commit.checksum", "profile, commit.start", "A set is not put in force by another one's checksum.", Mode::open,
         true},
        uds::routine_request(RoutineAction::start, *p.commit.id, profile::commit_start(p, spoilt).value_or(Bytes{})),
        {Nrc::request_out_of_range});
  }
  if (p.erase.id && judged) {
    c.refused({"set.not_erased", writing, "A slot that is not erased is not written.", Mode::open, true},
              uds::write_request(*p.set_inactive, set),
              {Nrc::general_programming_failure, Nrc::conditions_not_correct, Nrc::request_out_of_range});
  }
  if (p.erase.id) {
    try_erase(c, {"set.erase_again", routines, "The slot is erased again.", Mode::open, true});
  }
}

void try_reset(Conformance& c) {
  constexpr int start_up_s = 30;
  const Bytes request = uds::reset_request(uds::ResetType::hard);
  if (c.profile().security.needed) {
    c.refused({"reset.locked", reset, "While the lock is closed there is no restart.", Mode::session, true}, request,
              {Nrc::security_access_denied});
  }
  constexpr Requirement done{"reset.restart", reset, "The INS restarts, and begins in the default session.", Mode::open,
                             true};
  if (!c.ready(done)) {
    return;
  }
  const Exchange exchange = c.tester().ask(request);
  bool back = false;
  for (int second = 0; exchange.kind == Exchange::Kind::positive && !back && second < start_up_s; ++second) {
    c.tester().quiet(1.0);
    c.tester().put(Bytes{2, uds::service::tester_present, 0});
    back = c.tester().receive(uds::service::tester_present, 0.5).kind == Exchange::Kind::positive;
  }
  const Exchange after = back ? c.tester().ask(Bytes{0x31, 0x03}) : Exchange{};
  const bool standard = after.kind == Exchange::Kind::negative &&
                        (after.nrc == static_cast<std::uint8_t>(Nrc::service_not_supported_in_session) ||
                         after.nrc == static_cast<std::uint8_t>(Nrc::sub_function_not_supported_in_session));
  c.judged(done, fmt::format("{}, then 3E 00, then 31 03", hex(request)),
           fmt::format("51 01, an answer within {} s, then serviceNotSupportedInActiveSession (0x7F)", start_up_s),
           exchange.kind != Exchange::Kind::positive ? words(exchange)
           : !back                                   ? "no answer after it"
                                                     : words(after),
           standard);
}

}  // namespace

void try_writing(Conformance& c) {
  c.profile().move ? try_move(c) : try_schedule(c);
  c.profile().slots ? try_set(c) : try_writing_over(c);
  try_reset(c);
}

}  // namespace selfcal::cli::device
