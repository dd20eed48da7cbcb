// SecurityAccess.
#include <fmt/format.h>

#include <algorithm>

#include "protocol/uds/messages.hpp"
#include "tools/cli/device/conformance.hpp"

namespace selfcal::cli::device {
namespace {

using uds::Nrc;
constexpr std::string_view clause = "ISO 14229-1, 9.4";

bool all_zero(ByteView bytes) {
  return std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == 0; });
}

Bytes seed_of(Conformance& c) {
  const Exchange exchange = c.tester().ask(uds::seed_request(c.profile().security.level));
  return exchange.kind == Exchange::Kind::positive ? exchange.response : Bytes{};
}

void try_seeds(Conformance& c, std::uint8_t level) {
  c.answered({"security.seed", clause,
              "A seed of the profile's length is given, not all zeros while the lock is closed.", Mode::session},
             uds::seed_request(level), 1, [&](ByteView response) -> std::string {
               const auto seed = uds::read_seed_response(response, level, c.profile().security.seed_bytes);
               return !seed ? seed.error().message : all_zero(*seed) ? "all zeros" : "";
             });
  constexpr Requirement fresh{"security.fresh", clause, "Every seed is another one.", Mode::session};
  if (c.ready(fresh)) {
    const Bytes first = seed_of(c);
    const Bytes second = c.enter(Mode::session) ? seed_of(c) : Bytes{};
    c.judged(fresh, fmt::format("27 {:02X} in two sessions", level), "two seeds that differ",
             first.empty() || second.empty() ? "no seed"
             : first == second               ? "the same seed twice"
                                             : "two that differ",
             !first.empty() && !second.empty() && first != second);
  }
  c.refused({"security.too_long", clause, "A request for a seed with a byte too many is refused.", Mode::session},
            Bytes{0x27, level, 0x00}, {Nrc::incorrect_message_length, Nrc::request_out_of_range});
  c.refused({"security.too_short", clause, "SecurityAccess without a level is refused.", Mode::session}, Bytes{0x27},
            {Nrc::incorrect_message_length});
  const auto other = static_cast<std::uint8_t>(level == 0x3D ? 0x3B : 0x3D);
  c.refused({"security.level", clause, "A level that is none is refused.", Mode::session}, Bytes{0x27, other},
            {Nrc::sub_function_not_supported});
  c.refused({"security.sequence", clause, "A key without a seed before it is refused.", Mode::session},
            uds::key_request(Bytes(c.profile().security.key_bytes, 0), level), {Nrc::request_sequence_error});
}

void try_keys(Conformance& c, std::uint8_t level) {
  constexpr Requirement wrong{"security.wrong_key", clause, "A wrong key is refused.", Mode::session, true};
  if (!c.permission().key) {
    c.not_tried(wrong, "needs --key-file");
  } else if (c.ready(wrong)) {  // the right one behind it, so that no attempt stays counted
    const Bytes seed = seed_of(c);
    const Exchange exchange = c.tester().ask(uds::key_request(Bytes(c.profile().security.key_bytes, 0x5A), level));
    c.judged(wrong, fmt::format("27 {:02X}, then a key that is wrong", level), "invalidKey (0x35)", words(exchange),
             exchange.kind == Exchange::Kind::negative && exchange.nrc == static_cast<std::uint8_t>(Nrc::invalid_key));
    if (c.enter(Mode::session)) {
      c.unlock();
    }
  }
  constexpr Requirement right{"security.right_key", clause, "The right key opens the lock.", Mode::session};
  if (!c.permission().key) {
    return c.not_tried(right, "needs --key-file");
  }
  if (c.ready(right)) {
    const bool opened = c.unlock();
    c.judged(right, fmt::format("27 {:02X}, then the key", level), fmt::format("67 {:02X}", level + 1),
             opened ? fmt::format("67 {:02X}", level + 1) : c.why_not(), opened);
  }
  c.answered({"security.open_seed", clause, "While the lock is open the seed is all zeros.", Mode::open},
             uds::seed_request(level), 1,
             [](ByteView response) -> std::string { return all_zero(response.subspan(2)) ? "" : "not all zeros"; });
  constexpr Requirement closes{"security.closes", "ISO 14229-1, 9.2", "Entering a session closes the lock.",
                               Mode::open};
  if (c.ready(closes) && c.enter(Mode::session)) {
    const Bytes seed = seed_of(c);
    const bool closed = seed.size() > 2 && !all_zero(ByteView(seed).subspan(2));
    c.judged(closes, fmt::format("10 {:02X} with the lock open, then 27 {:02X}", c.profile().session, level),
             "a seed that is not all zeros",
             seed.empty() ? "no seed"
             : closed     ? "such a seed"
                          : "all zeros",
             closed);
  }
}

}  // namespace

void try_security(Conformance& c) {
  if (!c.profile().security.needed) {
    return;
  }
  const std::uint8_t level = c.profile().security.level;
  try_seeds(c, level);
  try_keys(c, level);
}

}  // namespace selfcal::cli::device
