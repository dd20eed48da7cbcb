// Rules drawn at random: the same seed, the same rules.
#include <fmt/format.h>

#include <array>
#include <random>

#include "tests/hostile/rule.hpp"
#include "tests/own_ins/status_frames.hpp"

namespace selfcal::hostile {
namespace {

using Generator = std::mt19937_64;

// Every request of a run.
constexpr std::array<std::string_view, 25> requests = {
    "1003",     "1001",     "2701",     "2702",   "22",     "22F18C", "22F195",   "220200",   "220202",
    "220210",   "220211",   "220220",   "220221", "2E0201", "2E0211", "31010301", "31020301", "31010302",
    "31010303", "31010304", "31030304", "35",     "36",     "37",     "1101"};

// std::uniform_int_distribution draws differently from library to library.
std::uint64_t below(Generator& draw, std::uint64_t limit) { return draw() % limit; }

uds::Bytes some_bytes(Generator& draw, std::size_t count) {
  uds::Bytes bytes(count);
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(draw());
  }
  return bytes;
}

uds::Bytes some_value(Generator& draw, char type) {
  static constexpr std::array<std::string_view, 8> integers = {"0", "1", "2", "127", "128", "254", "255", "max"};
  static constexpr std::array<std::string_view, 12> doubles = {"nan",  "inf",   "-inf", "0",     "-1",      "1e-300",
                                                               "1e-3", "1e300", "-5",   "1e308", "90.0001", "1e9"};
  if (below(draw, 3) == 0) {
    return some_bytes(draw, type == 'd' ? 8 : static_cast<std::size_t>(type - '0'));
  }
  return *value_bytes(type,
                      type == 'd' ? doubles[below(draw, doubles.size())] : integers[below(draw, integers.size())]);
}

Rule field_rule(Generator& draw) {
  const Field& field = fields()[below(draw, fields().size())];
  Rule rule;
  rule.request = *hex_bytes(field.request);
  rule.offset = field.offset;
  rule.seal = below(draw, 4) == 0 ? Seal::none : field.seal;
  rule.bytes = some_value(draw, field.type);
  rule.kind = below(draw, 5) == 0 ? Kind::flip : Kind::set;
  return rule;
}

Rule status_rule(Generator& draw) {
  Rule rule;
  rule.kind = static_cast<Kind>(static_cast<unsigned>(Kind::status_set) + below(draw, 4));
  const ins::Signal& signal = ins::status_signals[below(draw, ins::status_signals.size())];
  rule.signal = signal.name;
  rule.count = rule.kind == Kind::status_flood ? static_cast<std::uint32_t>(below(draw, 20))
                                               : static_cast<std::uint32_t>(draw() & ((1ULL << signal.bits) - 1));
  rule.offset = below(draw, 8);
  rule.bytes = some_bytes(draw, 1);
  return rule;
}

Rule answer_rule(Generator& draw) {
  Rule rule;
  rule.request = *hex_bytes(requests[below(draw, requests.size())]);
  rule.kind = static_cast<Kind>(below(draw, static_cast<std::uint64_t>(Kind::power_cut) + 1));
  rule.offset = below(draw, 40);
  rule.bytes = some_bytes(draw, below(draw, 12));
  rule.seconds = std::array{0.001, 0.05, 0.4, 0.9, 1.1, 3.0}[below(draw, 6)];
  rule.count = static_cast<std::uint32_t>(below(draw, 2) == 0 ? below(draw, 4) : below(draw, 300));
  if ((rule.kind == Kind::stranger || rule.kind == Kind::replace || rule.kind == Kind::swallow) &&
      below(draw, 2) == 0) {
    rule.bytes.insert(rule.bytes.begin(), static_cast<std::uint8_t>(rule.request[0] + 0x40));
    rule.bytes.insert(rule.bytes.begin() + 1, rule.request.begin() + 1, rule.request.end());
  }
  if (rule.kind == Kind::frame && rule.bytes.empty()) {
    rule.bytes = {0x10, 0xFF};
  }
  return rule;
}

}  // namespace

Case random_case(std::uint64_t seed) {
  Generator draw(seed);
  Case one;
  one.name = fmt::format("random {}", seed);
  const std::uint64_t count = 1 + below(draw, 3);
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t which = below(draw, 5);
    Rule rule = which < 2 ? field_rule(draw) : which == 2 ? status_rule(draw) : answer_rule(draw);
    rule.at = static_cast<std::uint32_t>(1 + (below(draw, 2) == 0 ? 0 : below(draw, 12)));
    rule.times = static_cast<std::uint32_t>(std::array<std::uint64_t, 4>{0, 1, 2, 5}[below(draw, 4)]);
    one.rules.push_back(rule);
  }
  one.reaches_ins = false;  // what holds at the end whatever was forged
  return one;
}

}  // namespace selfcal::hostile
