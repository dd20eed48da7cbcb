// What every fallible call across a boundary (file, bus, device, configuration) returns instead of a value.
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace selfcal {

// The kind decides the exit status of the programs (tools/handbook/exit-status.md): the numbers are theirs.
enum class ErrorKind {
  usage = 2,      // the request itself is wrong
  bad_input = 3,  // a file or message does not hold what it must
  device = 4,     // INS, bus or daemon trouble
  internal = 5,
};

struct Error {
  ErrorKind kind = ErrorKind::internal;
  std::string message;  // one line: what, where, which value
};

template <typename T>
using Expected = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(ErrorKind kind, std::string message) {
  return tl::unexpected<Error>(Error{kind, std::move(message)});
}

}  // namespace selfcal
