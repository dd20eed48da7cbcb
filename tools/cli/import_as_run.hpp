// selfcal import --as-run: hands a recording to the service, which takes it into the history as a run.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/error.hpp"

namespace selfcal::cli {

struct AsRun {
  std::string serial;  // empty: the recording's own
  std::string source;  // words of the operator
  std::string ins;
  bool json = false;
};

// `recording` is HDF5; `origin` is the file that it was made from. Waits for the end; the answer is the run's exit status.
Expected<int> import_as_run(const std::filesystem::path& recording, const std::filesystem::path& origin,
                            const AsRun& as_run);

}  // namespace selfcal::cli
