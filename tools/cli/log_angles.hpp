// The angle of a table that logs it in a file of its own.
#pragma once

#include <cstddef>
#include <string>

#include "protocol/error.hpp"
#include "tools/cli/poses_input.hpp"

namespace selfcal::cli {

// Into LOG as its outer read-out, on the line between two rows of FILE, whose clock is taken to be the log's; the delay between both shows by the turns.
// `column`: of FILE, from 1; 0: the only one that its name calls an angle. Rows of the log before FILE and behind it are left out. Errors (bad_input): no
// such column, no time, times that do not overlap by half of the log.
Expected<void> add_angles(const std::string& file, std::size_t column, const std::string& log_file, RawLog& log);

}  // namespace selfcal::cli
