// selfcal device odx: the profile for other diagnostic tools.
#pragma once

#include <string>

#include "protocol/error.hpp"

namespace selfcal::cli::device {

// Writes OUTPUT (.pdx) and prints what ODX cannot hold.
[[nodiscard]] Expected<int> write_odx(const std::string& file, const std::string& output);

}  // namespace selfcal::cli::device
