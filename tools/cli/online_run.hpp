// The last that is seen of a run.
#pragma once

#include <cstdint>

#include "tools/cli/online_client.hpp"
#include "tools/cli/online_follow.hpp"

namespace selfcal::cli {

// Three sentences in six lines at most, or the run's document. What went wrong is also one line on standard error, where that is
// not the same screen. The answer is the exit status.
Expected<int> report_ending(ManagerClient& manager, std::uint64_t run, const Ending& ending, bool json);

}  // namespace selfcal::cli
