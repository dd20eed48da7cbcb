// Runs a parser in a child process, so that a file that kills the library behind it kills only the child.
#pragma once

#include <functional>
#include <string>

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// What `parse` returns in the child, handed over through anonymous memory. A child that dies of a signal, or takes
// more than 120 s of processor time (a day at 2000 Hz takes 20), is an error (bad_input) about `name`. The child
// shares no file with the caller and leaves by _exit; its standard error is closed.
Expected<Recording> parse_isolated(const std::string& name, const std::function<Expected<Recording>()>& parse);

// The same for a parser whose result is bytes.
Expected<std::string> bytes_isolated(const std::string& name, const std::function<Expected<std::string>()>& parse);

}  // namespace selfcal
