// What the man in the middle does to which answer. A rule says for itself when it acts: on the requests whose bytes begin
// so, or on status frames, from the n-th one on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal::hostile {

enum class Kind : std::uint8_t {
  set,           // bytes `offset`.. of the answer become `bytes`
  flip,          // they are combined with `bytes` by exclusive or
  truncate,      // the answer ends after `count` bytes
  append,        // `bytes` behind it, `count` times, once if that is 0
  replace,       // the answer is `bytes`
  refuse,        // a negative response with NRC `count`
  withhold,      // no answer; the INS has done as it was asked
  swallow,       // the INS never hears of it, and the answer is `bytes`; none where that is empty
  delay,         // the answer comes `seconds` late
  repeat,        // it comes `count` times more
  previous,      // the answer to the request before comes instead
  pending,       // response-pending each `seconds`, `count` times, then the answer
  stranger,      // `bytes`, each `seconds`, `count` times, and never the answer
  frame,         // a raw frame of `bytes`, each `seconds`, `count` times, and never the answer
  trickle,       // one frame of the answer each `seconds`
  power_cut,     // the INS loses its power before it hears the request; `seconds` > 0: so long after it
  status_set,    // the signal `signal` of status frames becomes `count`
  status_raw,    // bytes `offset`.. of status frames become `bytes`
  status_off,    // no status frames
  status_flood,  // each status frame comes `count` times more
};
std::optional<Kind> kind_called(std::string_view name);
std::string_view name(Kind kind);
bool of_status(Kind kind);

// What has to be made right again after a field was changed, so that the answer is taken for whole.
enum class Seal : std::uint8_t { none, coefficients, page };

struct Rule {
  Kind kind = Kind::set;
  uds::Bytes request;       // of status rules: empty
  std::uint32_t at = 1;     // from the so many-th such request on
  std::uint32_t times = 0;  // so many times; 0: for ever
  std::size_t offset = 0;
  uds::Bytes bytes;
  std::string signal;
  std::uint32_t count = 0;
  double seconds = 0.0;
  Seal seal = Seal::none;

  bool matches(std::span<const std::uint8_t> message) const;
};

// One line: what it does, to what, from when.
std::string describe(const Rule& rule);

enum class Ending : std::uint8_t { any, failed, completed };

struct Case {
  std::string name;
  std::vector<Rule> rules;
  Ending ending = Ending::any;
  std::string says;  // regular expression for the line of a run that failed; empty: only what holds for every line
  bool reaches_ins = true;  // the end of the session can reach the INS, and the stop of its gimbal
};

// Every case of the file: each [[case]] with `values` is as many cases (README.md).
[[nodiscard]] Expected<std::vector<Case>> read_cases(const std::string& path);
// Up to three rules drawn from the seed.
Case random_case(std::uint64_t seed);

// A field of an answer of the INS, by record and name: "directory.samples".
struct Field {
  std::string_view name;
  std::string_view request;  // hexadecimal digits
  std::size_t offset;        // in the answer
  char type;                 // 1 2 4 8: unsigned bytes; d: double
  Seal seal;
};
std::span<const Field> fields();
// "0", "max", "nan", "1e-300", "-5", "0x40" as the bytes of the type.
std::optional<uds::Bytes> value_bytes(char type, std::string_view text);
std::optional<uds::Bytes> hex_bytes(std::string_view text);

}  // namespace selfcal::hostile
