// ISO 14229-1: what holds of every request, sessions and their end.
#include <fmt/format.h>

#include <array>

#include "protocol/profile/records.hpp"
#include "protocol/uds/messages.hpp"
#include "tools/cli/device/conformance.hpp"

namespace selfcal::cli::device {
namespace {

using uds::Nrc;

// S3_Server of ISO 14229-2; an INS that waits longer is not left in a session for ever.
constexpr double s3_s = 5.0, s3_over_s = 6.0;
constexpr double present_every_s = 1.8;
constexpr int presents = 3;
// The longest P2 and P2* that are taken up (uds::with_stated).
constexpr double longest_p2_s = 10.0, longest_p2_star_s = 30.0;

double in_s(Time time) { return std::chrono::duration<double>(time).count(); }

void try_every_request(Conformance& c) {
  constexpr std::string_view general = "ISO 14229-1, 7.5", present = "ISO 14229-1, 9.6";
  const auto bytes = [](std::initializer_list<std::uint8_t> list) { return Bytes(list); };
  c.answered({"present.answer", present, "TesterPresent is answered."}, bytes({0x3E, 0x00}), 1);
  c.silent({"present.suppressed", general, "With the suppress bit of the sub-function no positive response comes."},
           bytes({0x3E, 0x80}), false);
  c.refused({"present.sub_function", present, "A sub-function that is none is refused."}, bytes({0x3E, 0x01}),
            {Nrc::sub_function_not_supported});
  c.refused({"present.too_long", present, "A request that is too long is refused."}, bytes({0x3E, 0x00, 0x00}),
            {Nrc::incorrect_message_length});
  c.refused({"present.too_short", general, "A request without its sub-function is refused."}, bytes({0x3E}),
            {Nrc::incorrect_message_length});
  c.refused({"service.unknown", general, "A service that is none is refused."}, bytes({0xA5}),
            {Nrc::service_not_supported});
  c.silent({"functional.suppressed", general, "TesterPresent to all, with the suppress bit, is not answered."},
           bytes({0x3E, 0x80}), true);
  c.silent({"functional.unknown", general, "A service that is none, asked of all, is not answered."}, bytes({0xA5}),
           true);
}

std::string take_timings(Conformance& c, ByteView response) {
  const auto timings = uds::read_session_response(response, static_cast<uds::Session>(response[1]));
  if (!timings) {
    return timings.error().message;
  }
  const double p2_s = in_s(timings->p2), p2_star_s = in_s(timings->p2_star);
  if (!(p2_s > 0.0 && p2_s <= longest_p2_s && p2_star_s > 0.0 && p2_star_s <= longest_p2_star_s)) {
    return fmt::format("P2 {:g} s and P2* {:g} s, of which {:g} and {:g} s are taken up at most", p2_s, p2_star_s,
                       longest_p2_s, longest_p2_star_s);
  }
  constexpr double bus_delay_s = 0.1;
  c.tester().take_timings(p2_s + bus_delay_s, p2_star_s + bus_delay_s);
  return "";
}

void try_session_control(Conformance& c) {
  constexpr std::string_view clause = "ISO 14229-1, 9.2";
  const std::uint8_t own = c.profile().session;
  const auto judge = [&](ByteView response) { return take_timings(c, response); };
  c.answered({"session.default", clause, "The default session is entered, and P2 and P2* are stated."},
             uds::session_request(uds::Session::standard), 1, judge);
  c.answered({"session.calibration", clause, "The profile's session is entered, and P2 and P2* are stated."},
             uds::session_request(static_cast<uds::Session>(own)), 1, judge);
  c.refused({"session.too_short", clause, "DiagnosticSessionControl without a session is refused."}, Bytes{0x10},
            {Nrc::incorrect_message_length});
  c.refused({"session.too_long", clause, "DiagnosticSessionControl that is too long is refused."},
            Bytes{0x10, 0x01, 0x00}, {Nrc::incorrect_message_length});
  c.refused({"session.unknown", clause, "A session that is none is refused."}, Bytes{0x10, 0x7F},
            {Nrc::sub_function_not_supported});
  c.silent({"session.suppressed", "ISO 14229-1, 7.5", "With the suppress bit a session is entered without a response."},
           Bytes{0x10, static_cast<std::uint8_t>(own | uds::suppress_response_bit)}, false);
}

// What needs the session is refused in the default one. The requests would do nothing even if they were served.
Bytes guarded_request(const profile::Profile& p) {
  return p.security.needed ? uds::seed_request(p.security.level)
                           : uds::routine_request(uds::RoutineAction::result, *p.rotate.id);
}

void try_guards(Conformance& c) {
  constexpr std::string_view clause = "ISO 14229-1, 7.5";
  const profile::Profile& p = c.profile();
  const std::initializer_list<Nrc> codes{Nrc::service_not_supported_in_session,
                                         Nrc::sub_function_not_supported_in_session};
  if (p.security.needed) {
    c.refused({"session.guards_seed", clause, "In the default session no seed is given."},
              uds::seed_request(p.security.level), codes);
  }
  if (p.rotate.id) {
    c.refused({"session.guards_routines", clause, "In the default session no routine is served."},
              uds::routine_request(uds::RoutineAction::result, *p.rotate.id), codes);
  }
}

void try_session_end(Conformance& c) {
  const Bytes guarded = guarded_request(c.profile());
  constexpr Requirement expires{"session.expires", "ISO 14229-2, S3_Server",
                                "A session in which nothing is asked for more than 5 s ends.", Mode::session};
  if (c.ready(expires)) {
    c.tester().quiet(s3_over_s);
    const Exchange exchange = c.tester().ask(guarded);
    const bool over = exchange.kind == Exchange::Kind::negative &&
                      (exchange.nrc == static_cast<std::uint8_t>(Nrc::service_not_supported_in_session) ||
                       exchange.nrc == static_cast<std::uint8_t>(Nrc::sub_function_not_supported_in_session));
    c.judged(expires, fmt::format("nothing for {:g} s, then {}", s3_over_s, hex(guarded)),
             "a refusal, since the session is over", words(exchange), over);
  }
  constexpr Requirement kept{"session.kept", "ISO 14229-1, 9.6", "TesterPresent to all keeps the session.",
                             Mode::session};
  if (c.ready(kept)) {
    for (int k = 0; k < presents; ++k) {
      c.tester().quiet(present_every_s);
      c.tester().tell_all(uds::tester_present_request(true));
    }
    const Exchange exchange = c.tester().ask(guarded);
    // A routine that needs the lock open, or was never started, says so: the session is there.
    const bool there = exchange.kind == Exchange::Kind::positive ||
                       (exchange.kind == Exchange::Kind::negative &&
                        exchange.nrc != static_cast<std::uint8_t>(Nrc::service_not_supported_in_session) &&
                        exchange.nrc != static_cast<std::uint8_t>(Nrc::sub_function_not_supported_in_session));
    c.judged(kept, fmt::format("3E 80 to all, {} times every {:g} s, then {}", presents, present_every_s, hex(guarded)),
             "an answer as in the session", words(exchange), there);
  }
}

}  // namespace

void try_sessions(Conformance& c) {
  static_assert(s3_over_s > s3_s && presents * present_every_s > s3_s);
  try_session_control(c);
  try_every_request(c);
  try_guards(c);
  try_session_end(c);
}

}  // namespace selfcal::cli::device
