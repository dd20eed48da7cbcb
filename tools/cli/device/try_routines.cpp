// RoutineControl, without starting anything.
#include <fmt/format.h>

#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"
#include "tools/cli/device/conformance.hpp"
#include "tools/cli/device/unused_number.hpp"

namespace selfcal::cli::device {

void try_routines(Conformance& c) {
  using uds::Nrc;
  using uds::RoutineAction;
  constexpr std::string_view clause = "ISO 14229-1, 13.2";
  const profile::Profile& p = c.profile();
  if (!p.rotate.id) {
    return;
  }
  const Bytes result = uds::routine_request(RoutineAction::result, *p.rotate.id);
  if (p.security.needed) {
    c.refused({"routine.locked", clause, "While the lock is closed no routine is served.", Mode::session}, result,
              {Nrc::security_access_denied});
  }
  c.refused({"routine.unknown", clause, "A routine that is none is refused.", Mode::open},
            uds::routine_request(RoutineAction::result, unused_routine), {Nrc::request_out_of_range});
  c.refused({"routine.sub_function", clause, "Neither start, stop nor result is refused.", Mode::open},
            uds::routine_request(static_cast<RoutineAction>(4), *p.rotate.id), {Nrc::sub_function_not_supported});
  c.refused({"routine.too_short", clause, "A routine without its identifier is refused.", Mode::open},
            Bytes{0x31, 0x03}, {Nrc::incorrect_message_length});
  constexpr Requirement told{"routine.result", clause,
                             "The rotation's result is told as the profile lays it out, or it was never started.",
                             Mode::open};
  if (c.ready(told)) {
    const Exchange exchange = c.tester().ask(result);
    const bool never = exchange.kind == Exchange::Kind::negative &&
                       exchange.nrc == static_cast<std::uint8_t>(Nrc::request_sequence_error);
    const auto record = uds::read_routine_response(exchange.response, RoutineAction::result, *p.rotate.id);
    const auto run = record ? profile::decode_run(p, *record) : tl::unexpected(record.error());
    c.judged(told, hex(result), "the record, or requestSequenceError (0x24)",
             never || run ? words(exchange) : fmt::format("{}: {}", words(exchange), run.error().message),
             never || run);
  }
}

}  // namespace selfcal::cli::device
